#!/usr/bin/env bash
# libFuzzer on every target, as many at once as there are processors: fuzz.sh BINARY SECONDS FOLDER
# A target goes on from what the seeds and earlier runs in FOLDER found. One line for each: executions and CPU seconds of
# this run, inputs that are kept, finds; in the end the CPU hours of all runs in FOLDER. Exit code 1: something was
# found; it stays in FOLDER/finds. FUZZ_SEED chooses the mutations; without it they are others each time.
set -euo pipefail

# fuzz_target BINARY SECONDS FOLDER TARGET SEEDS: one line of the table
fuzz_target() {
  local binary=$1 seconds=$2 folder=$3 target=$4 seeds=$5 log=$3/$4.log code=0 executions cpu
  mkdir -p "$folder/corpus/$target"
  cp $seeds "$folder/corpus/$target"
  TIMEFORMAT='%U %S'
  { time nice -n 15 "$binary" --target="$target" -seed="${FUZZ_SEED:-0}" -max_total_time="$seconds" -timeout=60 \
    -report_slow_units=60 -rss_limit_mb=6144 -malloc_limit_mb=3072 -print_final_stats=1 \
    -artifact_prefix="$folder/finds/$target-" \
    "$folder/corpus/$target" >"$log" 2>&1; } 2>"$log.time" || code=1
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  cpu=$(awk '{ print $1 + $2 }' "$log.time")
  echo "$target $cpu" >>"$folder/cpu"
  printf '%-10s %12s %8.0f %8d %8d\n' "$target" "$executions" "$cpu" "$(find "$folder/corpus/$target" -type f | wc -l)" \
    "$(find "$folder/finds" -name "$target-*" | wc -l)"
  if [[ $code -ne 0 ]]; then
    grep -m 3 -E 'ERROR:|SUMMARY:|does not hold|runtime error:|Test unit written' "$log" || tail -n 3 "$log"
  fi
  return $code
}
export -f fuzz_target

if [[ $# -ne 3 || ! -f $1 || ! -x $1 ]]; then
  echo "usage: $0 BINARY SECONDS FOLDER" >&2
  exit 2
fi
binary=$(realpath "$1")
seconds=$2
mkdir -p "$3/finds"
folder=$(realpath "$3")
cd "$(dirname "$0")/../.."  # where the seeds are
failed=0
printf '%-10s %12s %8s %8s %8s\n' target executions CPU-s corpus finds
"$binary" --list | xargs -P "$(nproc)" -L 1 bash -c 'fuzz_target "$@"' "$0" "$binary" "$seconds" "$folder" || failed=1
awk '{ seconds += $2 } END { printf "%.2f CPU hours in all\n", seconds / 3600 }' "$folder/cpu"
exit $failed
