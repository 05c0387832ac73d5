#!/usr/bin/env bash
# Sweeps, tunes and views over and over, and watches what that takes: soak.sh BINARY SECONDS FOLDER
# A soak of the same binary that was stopped goes on in its FOLDER after its last whole round; SECONDS are of all sittings.
# Each second it notes memory and descriptors of every process of the binary in FOLDER/watch.tsv. In the end it prints,
# for each command and its workers, the medians of the first and of the last third of the rounds, three at least, and of
# the second and the last quarter of a process's life; what leaks is marked. Exit code 1: something leaks, was left
# behind, or failed.
set -euo pipefail

if [[ $# -ne 3 ]]; then
  echo "usage: $0 BINARY SECONDS FOLDER" >&2
  exit 2
fi
if [[ ! -f $1 || ! -x $1 ]]; then
  echo "soak: $1 is not a program" >&2
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
binary=$(realpath "$1")
seconds=$2
build=$(sha256sum <"$binary")
if [[ -d $3 && ( ! -f $3/build || $(<"$3/build") != "$build" ) ]]; then
  echo "soak: $3 holds none of this binary: it begins anew"
  rm -rf "$3"
fi
mkdir -p "$3"
folder=$(realpath "$3")
export RELIEFBENCH_CACHE=$folder/cache
watch=$folder/watch.tsv
echo "$build" >"$folder/build"

# One line for each process: round, command, id, seconds since the soak began, kB, descriptors.
watch_processes() {
  set +e  # a process may be gone while it is looked at
  local process id memory descriptors words
  while sleep 1; do
    for process in /proc/[0-9]*; do
      [ "$(readlink "$process/exe" 2>/dev/null)" = "$binary" ] || continue
      words=$(tr '\0' ' ' <"$process/cmdline" 2>/dev/null | cut -d ' ' -f 2)
      id=${process#/proc/}
      memory=$(sed -n 's/^VmRSS:[^0-9]*\([0-9]*\).*/\1/p' "$process/status" 2>/dev/null)
      descriptors=$(ls "$process/fd" 2>/dev/null | wc -l)
      [ -n "$memory" ] || continue
      printf '%s\t%s\t%s\t%s\t%s\t%s\n' "$(cat "$folder/round")" "$words" "$id" "$SECONDS" "$memory" "$descriptors"
    done >>"$watch"
  done
}

# What stays on the machine beside the folder: shared memory, and files in /tmp.
left_behind() { find /dev/shm /tmp -maxdepth 1 -name '*reliefbench*' | sort; }

failed=0
# Runs a command of the binary; 1 and 4 are answers. After a failure nothing runs any more.
run() {
  [[ $failed -eq 0 ]] || return 0
  local code=0
  "$@" >>"$folder/log" 2>&1 || code=$?
  if [[ $code -ne 0 && $code -ne 1 && $code -ne 4 ]]; then
    echo "soak: exit code $code: $*" >&2
    failed=1
  fi
}

left_behind >"$folder/before"
round=0
[[ ! -f $folder/done ]] || read -r round SECONDS <"$folder/done"
[[ $round -eq 0 ]] || echo "soak: goes on after $round rounds in $SECONDS s"
touch "$watch"
awk -F '\t' -v rounds=$round '$1 <= rounds' "$watch" >"$watch.new" && mv "$watch.new" "$watch"
echo $round >"$folder/round"
watch_processes &
watcher=$!
trap 'kill $watcher 2>/dev/null || true' EXIT  # it may be gone, which is no failure
while [[ ( $round -eq 0 || $SECONDS -lt $seconds ) && $failed -eq 0 ]]; do
  round=$((round + 1))
  echo $round >"$folder/round"
  rm -rf "$folder/sweep" "$folder/tune"
  run "$binary" sweep "$here/../configs/quickstart.json" --backend all -o "$folder/sweep" --quiet
  run "$binary" tune rocks --max-error 'e_xy.p99<=0.5' --time-limit 2m -o "$folder/tune" --quiet
  for backend in opengl vulkan; do
    run xvfb-run -a "$binary" view rocks --backend $backend --frames 1500
  done
  echo "$round $SECONDS" >"$folder/done.new" && mv "$folder/done.new" "$folder/done"
done
kill $watcher || failed=1
left_behind >"$folder/after"

echo "soak: $round rounds in $SECONDS s; medians of memory and open descriptors"
awk -F '\t' -v rounds=$round -f "$here/soak.awk" "$watch" || failed=1
if ! new=$(comm -13 "$folder/before" "$folder/after") || [ -n "$new" ]; then
  echo "left behind: $new"
  failed=1
fi
exit $failed
