#!/usr/bin/env bash
# Slurm on this machine alone: a controller and two nodes in a folder of their own, beside whatever Slurm runs here.
# Four shards of a sweep, and a node is killed in the middle of one: the joined run must have the ids and the errors of
# an undivided one.
#   RELIEFBENCH_SLURM=1 tests/cluster/slurm_test.sh RELIEFBENCH [BACKEND]
# Needs slurmctld, slurmd, slurm-client, munge, python3 and root; takes about two minutes.
set -euo pipefail
export PATH=$PATH:/usr/sbin
for needed in slurmctld slurmd munged sbatch; do
  if [ "${RELIEFBENCH_SLURM:-}" != 1 ] || ! command -v $needed >/dev/null; then
    echo "skipped: it wants RELIEFBENCH_SLURM=1 and slurmctld, slurmd, slurm-client, munge"
    exit 77
  fi
done
reliefbench=$(realpath "$1") backend=${2:-opengl}
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d /tmp/reliefbench_slurm_XXXXXX)
host=$(hostname -s)
declare -A pid

say() { printf '%s %s\n' "$(date +%T)" "$*" >&2; }

end() {
  local code=$?
  for name in "${!pid[@]}"; do kill -9 "${pid[$name]}" 2>/dev/null || true; done
  if [ $code = 0 ]; then rm -rf "$work"; else say "FAILED; the logs are in $work"; fi
}
trap end EXIT

# wait_until SECONDS COMMAND...
wait_until() {
  local left=$1
  shift
  until "$@"; do
    left=$((left - 1))
    if [ $left -lt 0 ]; then
      say "waited in vain: $*"
      return 1
    fi
    sleep 1
  done
}

# --- a cluster of two nodes, each with a process number space of its own: it dies with all that runs on it
mkdir -p "$work"/{state,n1,n2,munge}
chmod 755 "$work"
chmod 711 "$work/munge"
head -c 1024 /dev/urandom >"$work/munge/key"
chmod 400 "$work/munge/key"
cat >"$work/slurm.conf" <<CONF
ClusterName=reliefbench
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthInfo=socket=$work/munge/socket
SlurmctldPort=27817
SlurmctldPidFile=$work/slurmctld.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdPidFile=$work/%n.pid
SlurmdLogFile=$work/%n.log
SlurmdSpoolDir=$work/%n
StateSaveLocation=$work/state
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=10
KillWait=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=27818 CPUs=1
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=27819 CPUs=1
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/log" --seed-file="$work/munge/seed" &>"$work/munged.out" &
pid[munged]=$!
disown $!  # or bash tells its end
wait_until 10 test -S "$work/munge/socket"
slurmctld -D &>"$work/slurmctld.out" &
pid[slurmctld]=$!
disown $!
for node in n1 n2; do
  unshare --pid --fork --kill-child --mount-proc slurmd -D -N $node &>"$work/$node.out" &
  pid[$node]=$!
  disown $!
done
are_both_up() { [ "$(sinfo -h -N -o '%t' | grep -c idle)" = 2 ]; }
wait_until 30 are_both_up
say "two nodes are up"

# --- an undivided run, and four shards
config=$work/config.json
cat >"$config" <<'JSON'
{"scenes": [{"heightmap": {"source": "fbm", "width": 64, "height": 64}, "frame_px": [128, 128],
             "views": ["oblique", "grazing"]}],
 "measure": {"samples": 5, "batch_ms": 10, "warmup_batches_max": 2, "block_cases": 2},
 "sweeps": [{"technique": "flat"}, {"technique": "parallax"},
            {"technique": "relief", "axes": {"linear_steps": [8, 16, 32], "refinement": ["none", "secant", "binary"]}},
            {"technique": "cone", "axes": {"cone_steps": [16, 64], "format": ["rg8", "rg16"]}},
            {"technique": "relaxed_cone", "axes": {"format,encoding": [["rg8", "sqrt"], ["rg16f", "ratio"]]}}]}
JSON
RELIEFBENCH_CACHE=$work/cache_of_whole "$reliefbench" sweep "$config" --backend "$backend" -o "$work/whole" --quiet \
  >"$work/whole.log"
say "undivided: $(head -1 "$work/whole.log")"
read -r array merge < <(RELIEFBENCH=$reliefbench RELIEFBENCH_SWEEP="--backend $backend" \
  "$root/configs/cluster/submit.sh" "$config" "$work/out" 4)
say "submitted: array $array, merge $merge"

# --- a node dies when a shard there is half done
cases_of() { cat "$work/out/shard_$1/results.jsonl" 2>/dev/null | wc -l; }
is_half_done() {
  shard=$(squeue -h -w n2 -t R -o '%K' | head -1)
  [ -n "$shard" ] && [ "$(cases_of "$shard")" -ge 2 ]
}
wait_until 120 is_half_done
kill -9 "${pid[n2]}"
held=$(cases_of "$shard")
say "n2 is killed, on which shard $shard had $held cases"
is_requeued() { grep -q "requeue.*JobId=$array" "$work/slurmctld.log" || [ "$(squeue -h -j "${array}_$shard" -o %T)" = PENDING ]; }
wait_until 90 is_requeued
say "Slurm has found out, and shard $shard waits for a node"

# --- the other node does the rest
is_over() { [ -z "$(squeue -h)" ]; }
wait_until 300 is_over
tail -3 "$work/out/merge.log" >&2
python3 - "$work" "$held" "$shard" <<'PYTHON'
import json, os, sys

work, held, shard = sys.argv[1], int(sys.argv[2]), sys.argv[3]

def records(folder):
    latest = {}
    with open(os.path.join(folder, "results.jsonl")) as lines:
        for line in lines:
            record = json.loads(line)
            latest[record["case"]] = record
    return latest

def finding(record):
    return [record.get(key) for key in ("error", "status", "scene_key", "timing_key", "bake_key", "memory_bytes")]

whole, merged = records(work + "/whole"), records(work + "/out/merged")
assert whole.keys() == merged.keys(), sorted(whole.keys() ^ merged.keys())
for case in whole:
    assert finding(whole[case]) == finding(merged[case]), case
own = json.load(open(f"{work}/out/shard_{shard}/run.json"))
assert own["counts"]["resumed"] >= held > 0, own["counts"]
assert json.load(open(work + "/out/merged/run.json"))["finished"]
assert os.path.exists(work + "/out/merged/report.html")
print(f"{len(whole)} cases: the same ids and errors as undivided; shard {shard} went on from {own['counts']['resumed']} cases")
PYTHON
