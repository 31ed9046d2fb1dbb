#!/usr/bin/env bash
# Show that a stage of set-up is at work: tools/alive.sh TITLE STATE STAMP, until it is killed.
#
# On a terminal that is one line, renewed every second: the title, the seconds so far, and what was
# last written to a log of the folder STATE. Elsewhere it is a line every 15 seconds ($EVERY of them,
# each as long as $SECOND says), and the file STATE/told says that there was one. Kernels that were
# compiled since STAMP are counted, as nothing else tells of them.
set -euo pipefail

readonly title=$1 state=$2 stamp=$3 parent=$PPID second=${SECOND:-1}
readonly began=$EPOCHREALTIME
exec {terminal}>&1  # also where stdout is something else
exec {pause}<> <(:)  # nothing ever comes: to wait without a process that would outlive this one

# What this stage wrote last to any log, without commands as the shell traces them.
last_line() {
  local logs=("$state"/*.log) newest log
  newest=${logs[0]}
  for log in "${logs[@]}"; do [[ ! $log -nt $newest ]] || newest=$log; done
  tail -c 4000 "$newest" 2>/dev/null | tr '\r\t' '\n ' | tr -d '\000-\011\013-\037\177' |
    awk '/^== / { line = ""; next } !/^\++ / && /[^ ]/ { line = $0 }
      END { sub(/^ +/, "", line); print line }'
}

doing() {
  local line compiled
  line=$(last_line)
  if [[ -z $line || $line == "compiling kernels" ]]; then
    compiled=$(find focus_planner -name '*.nbi' -newer "$stamp" 2>/dev/null | wc -l)
    case $((compiled)) in
      0) ;;
      1) line="1 kernel compiled" ;;
      *) line="$((compiled)) kernels compiled" ;;
    esac
  fi
  printf '%s' "$line"
}

elapsed() { awk -v start="$began" -v now="$EPOCHREALTIME" 'BEGIN { printf "%d s", now - start }'; }

show() {
  local width line
  width=$(stty size 2>/dev/null <&"$terminal") || width=
  width=${width#* }
  ((${width:-0} > 0)) || width=80
  line=$(printf '%-34s%-7s%s' "$title" "$(elapsed)" "$(doing)")
  printf '\r\033[K%s' "${line:0:width - 4}"  # the terminal echoes ^C at the end
}

say() {
  [[ -e $state/told ]] || echo
  printf '  %-7s%s\n' "$(elapsed)" "$(doing)"
  : >"$state/told"
}

what=say steps=${EVERY:-15}
if [[ -t 1 && ${TERM:-dumb} != dumb ]]; then what=show steps=1; fi
for ((step = 1; ; step++)); do
  read -rt "$second" -u "$pause" || :
  kill -0 "$parent" 2>/dev/null || exit 0
  ((step % steps)) || "$what"
done
