#!/usr/bin/env bash
# slurm.sh PROGRAM SCENES RECIPE FOLDER: makes the dataset FOLDER/set with the array job of
# SCENES/slurm on a private Slurm cluster of two nodes, where one task fails, one is requeued and
# one loses its node; then merges it.
set -euo pipefail
program=$1 scenes=$2 recipe=$3 folder=$4
d=$(mktemp -d /tmp/ensonify-slurm-XXXXXX)
port=$((20000 + RANDOM % 20000))

finish() {
  for p in "$d"/slurmd.*.pid "$d/slurmctld.pid" "$d/mrun/munged.pid"; do
    [[ -s $p ]] || continue
    pid=$(cat "$p")
    kill "$pid" 2>/dev/null || continue
    for _ in $(seq 40); do kill -0 "$pid" 2>/dev/null || break; sleep 0.25; done
  done
  rm -rf "$d"
}
trap finish EXIT

# Two nodes on this host, loopback only; no systemd, cgroups or accounting.
host=$(hostname -s)
mkdir -p "$d"/{munge,state,spool/n0,spool/n1,log,mrun}
chmod 755 "$d" "$d/spool" "$d/mrun"
chmod 700 "$d/munge" "$d/state"
dd if=/dev/urandom of="$d/munge/munge.key" bs=128 count=1 2>/dev/null
chmod 400 "$d/munge/munge.key"
cat >"$d/slurm.conf" <<CONF
ClusterName=ensonify
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$d/mrun/munge.socket,cred_expire=5
StateSaveLocation=$d/state
SlurmdSpoolDir=$d/spool/%n
SlurmctldPidFile=$d/slurmctld.pid
SlurmdPidFile=$d/slurmd.%n.pid
SlurmctldLogFile=$d/log/slurmctld.log
SlurmdLogFile=$d/log/slurmd.%n.log
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$d/log/jobcomp.txt
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=1,sched_interval=2,bf_interval=2
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=30
InactiveLimit=0
MinJobAge=300
KillWait=30
NodeName=n0 NodeAddr=127.0.0.1 NodeHostname=$host Port=$((port + 1)) CPUs=2 RealMemory=500
NodeName=n1 NodeAddr=127.0.0.1 NodeHostname=$host Port=$((port + 2)) CPUs=2 RealMemory=500
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
CONF
case "$(slurmd -V | sed 's/[^0-9]*\([0-9]*\.[0-9]*\).*/\1/')" in
  2[0-3].* | 24.02)  # a cgroup plugin without effect; later versions can disable it
    mkdir -p "$d/nocgroup"
    printf 'CgroupPlugin=cgroup/v1\nCgroupMountpoint=%s\n' "$d/nocgroup" >"$d/cgroup.conf"
    ;;
  *) echo 'CgroupPlugin=disabled' >"$d/cgroup.conf" ;;
esac
export SLURM_CONF=$d/slurm.conf
munged --key-file="$d/munge/munge.key" --socket="$d/mrun/munge.socket" --pid-file="$d/mrun/munged.pid" \
  --log-file="$d/log/munged.log" --seed-file="$d/munge/seed" --num-threads=2
slurmctld -f "$SLURM_CONF"
slurmd -f "$SLURM_CONF" -N n0
slurmd -f "$SLURM_CONF" -N n1
for _ in $(seq 60); do
  (($(sinfo -h -N -t idle -o %N 2>/dev/null | wc -l) == 2)) && break
  sleep 0.5
done

# The program, except that task 1 fails the first time, after its first sample.
cat >"$d/program" <<SH
#!/bin/sh
if [ "\$1" = generate ] && [ "\$SLURM_ARRAY_TASK_ID" = 1 ] && [ ! -e "$d/failed" ]; then
  touch "$d/failed"
  exit 1
fi
exec "$program" "\$@"
SH
chmod +x "$d/program"
mkdir -p "$folder"
variables=ALL,SHARDS=4,RECIPE=$recipe,DATASET=$folder/set,ENSONIFY=$d/program
submit() { sbatch --parsable --output="$d/log/%A_%a.out" --export="$variables" "$@"; }
state() { squeue -h -t all -j "$1" -o %T 2>/dev/null || true; }
wait_state() {  # JOB STATE: waits for it
  for _ in $(seq 600); do
    [[ $(state "$1") == "$2" ]] && return
    sleep 0.1
  done
  echo "job $1 never became $2: $(state "$1")" >&2
  exit 1
}

job=$(submit --array=0-3 --cpus-per-task=1 "$scenes/slurm/generate.sbatch")
wait_state "${job}_2" RUNNING
scontrol requeue "${job}_2"
wait_state "${job}_3" RUNNING
node=$(squeue -h -j "${job}_3" -o %N)
kill -9 "$(cat "$d/slurmd.$node.pid")"  # the node is lost; its processes live on for a while
rm -f "$d/slurmd.$node.pid"
scontrol update nodename="$node" state=down reason=killed
for _ in $(seq 1200); do
  [[ -z $(squeue -h -j "$job" -t PENDING,RUNNING,COMPLETING,SUSPENDED,CONFIGURING -o %T) ]] && break
  sleep 0.25
done
wait_state "${job}_1" FAILED
for task in 0 2 3; do wait_state "${job}_$task" COMPLETED; done
again=$(submit --array=1 --cpus-per-task=1 "$scenes/slurm/generate.sbatch")
merge=$(submit --dependency=afterok:"$again" "$scenes/slurm/merge.sbatch")
wait_state "${again}_1" COMPLETED
wait_state "$merge" COMPLETED
