#!/bin/sh
# Fails when a C++ file of the project is not laid out as .clang-format says. usage: format.sh [ROOT] [CLANG_FORMAT]
# Exit code 77 (skipped): clang-format is not installed. To repair: clang-format -i FILE.
set -eu
root=${1:-$(dirname "$0")/../..}
format=${2:-clang-format}
command -v "$format" >/dev/null || { echo "$format is not installed"; exit 77; }
cd "$root"
find jobs analysis archive simulation scenarios engine sampling graze tests bench -name '*.h' -print0 -o -name '*.cpp' -print0 |
  sort -z | xargs -0 "$format" --dry-run -Werror
