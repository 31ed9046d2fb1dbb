#!/usr/bin/env bash
# Check that every package of requirements.lock has a wheel wherever no marker leaves it out.
#
#   tools/check_lock.sh UV
#
# Asks the package index, installs nothing. A line for each system and Python that lacks one, with
# what uv says.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Open3D's wheels take glibc 2.35, of Ubuntu 22.04 and Debian 12, and are the strictest.
readonly systems=(
  x86_64-manylinux_2_35 aarch64-manylinux_2_35 aarch64-apple-darwin x86_64-pc-windows-msvc
)
export MACOSX_DEPLOYMENT_TARGET=13.0
readonly pythons=(3.10 3.11 3.12 3.13)
# Pure Python, of which there is only the source.
readonly only_sources=empy

target=$(mktemp -d)
trap 'rm -r "$target"' EXIT
status=0
for system in "${systems[@]}"; do
  for python in "${pythons[@]}"; do
    "$1" pip install --dry-run --quiet --target "$target" \
      --python-platform "$system" --python-version "$python" \
      --only-binary :all: --no-binary "$only_sources" \
      --no-deps --require-hashes -r requirements.lock >"$target/said" 2>&1 && continue
    status=1
    echo "requirements.lock cannot be installed on $system with Python $python:"
    sed 's/^/  /' "$target/said"
  done
done
exit "$status"
