#!/usr/bin/env bash
# A sweep on a Slurm cluster: N shards as an array job, then a job that joins them and writes the report.
#   configs/cluster/submit.sh CONFIG OUT N [SBATCH OPTION...]      e.g. --partition=gpu --gres=gpu:1 --exclusive
# OUT lies on a file system that all nodes share. Again with the same words, it goes on with what is not finished.
#   RELIEFBENCH        the binary                                     (default: reliefbench)
#   RELIEFBENCH_CACHE  the folder of what nodes share                 (default: OUT/cache)
#   RELIEFBENCH_SWEEP  further options of `sweep`, e.g. --backend vulkan
set -euo pipefail
if [ $# -lt 3 ]; then
  sed -n '2,7s/^# \{0,1\}//p' "$0"
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
config=$(realpath "$1") out=$(realpath -m "$2") shards=$3
shift 3
mkdir -p "$out"
export RELIEFBENCH=${RELIEFBENCH:-reliefbench} RELIEFBENCH_CONFIG=$config RELIEFBENCH_OUT=$out RELIEFBENCH_SHARDS=$shards
export RELIEFBENCH_CACHE=${RELIEFBENCH_CACHE:-$out/cache} RELIEFBENCH_SWEEP=${RELIEFBENCH_SWEEP:-}
array=$(sbatch --parsable --export=ALL --chdir="$PWD" --array="1-$shards" --output="$out/shard_%a.log" "$@" "$here/shard.sbatch")
merge=$(sbatch --parsable --export=ALL --chdir="$PWD" --dependency="afterany:$array" --output="$out/merge.log" "$here/merge.sbatch")
echo "$array $merge"
