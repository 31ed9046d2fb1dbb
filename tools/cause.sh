#!/usr/bin/env bash
# Print why the last stage in a log of set-up failed: tools/cause.sh LOG
#
# That is the last Python exception with the innermost line outside libraries that led to it, and
# what pip, uv, apt-get, CMake, compilers and the shell report as errors; if there is nothing of the
# kind, the end of the log.
set -euo pipefail

awk '
function add(line) {
  sub(/[ \t\r]+$/, "", line)
  if (length(line) > 200) line = substr(line, 1, 197) "..."
  if (line ~ /[^ \t]/ && !(line in told)) { told[line] = 1; errors[++count] = line }
}
function forget() {
  split("", told); split("", errors); split("", exception); split("", last)
  count = lines = seen = 0
  where = any_where = ""; state = "outside"
}
BEGIN { forget() }
/^== / { forget(); next }  # the heading of a stage
/^\++ / { state = "outside"; next }  # a command, traced by the shell
{ last[++seen] = $0 }

# A traceback: frames are indented, the exception begins in the first column.
/^Traceback \(most recent call last\):/ {
  state = "frames"; lines = 0; where = any_where = ""
  next
}
state == "frames" && /^  File "/ { frame = $0; sub(/, in .*/, "", frame); next_is_code = 1; next }
state == "frames" && /^ / {
  if (next_is_code) {
    code = $0; sub(/^ +/, "", code); sub(/^  File /, "", frame)
    any_where = "  in " frame ": " code
    if (frame !~ /site-packages|lib\/python3|<frozen|<string>/) where = any_where
    next_is_code = 0
  }
  next
}
state == "frames" && /^[^ ]/ { state = "exception" }
state == "exception" && /^(The above exception|During handling)/ { state = "outside" }
state == "exception" && NF {
  if (lines < 8) exception[++lines] = $0
  if (/^(\[[0-9]+\/[0-9]+\]|ninja:|FAILED:|ERROR:|error:|CMake Error)/) { lines--; state = "outside" }
  else next
}

# Errors of tools; what pip ignored is no cause.
state == "cmake" && /^[^ ]/ { state = "outside" }
state == "cmake" { if (NF && ++taken < 6) add($0); next }
/^CMake Error/ { add($0); state = "cmake"; taken = 0; next }
/^ERROR: Ignored / { next }
/^(ERROR|error|E|FAILED): / || /^ +cause: / || / (fatal )?error: / || /undefined reference/ { add($0) }
/command not found|No space left on device|Permission denied|Cannot allocate memory/ { add($0) }
/(^| )Killed( |$)/ { add($0) }

END {
  for (i = 1; i <= lines; i++) print exception[i]
  if (!where) where = any_where
  if (lines && where) print where
  for (i = 1; i <= count && i <= 12; i++) print errors[i]
  if (count > 12) print "... and " count - 12 " more lines of errors"
  if (!lines && !count)
    for (i = (seen > 15 ? seen - 14 : 1); i <= seen; i++) print last[i]
}' "$1"
