#!/usr/bin/env bash
# Compares an evaluation on Slurm with the same evaluation on one machine: Debian's slurm-wlm and munge, a controller and two node
# daemons on this machine, without systemd. A sweep of parts x models S and C x seeds runs as job arrays; meanwhile one node's daemon is
# killed, one unit is made to fail, and the controller is restarted. The tables must equal those of the serial run except for times.
# All files are in target/slurm; the processes end with the script.
#
#   PARTS=8 SEEDS=2 STEPS=2     size of the sweep
#   SDG=target/release/sdg      the program
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install.sh slurm-wlm munge python3
[ "$(id -u)" -eq 0 ] || { echo "test-slurm: needs root: the node daemons start jobs as their users" >&2; exit 1; }

target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
sdg=$(realpath "${SDG:-$target/release/sdg}")
all_parts=(pendulum fuel_line rod_end housing pneumatic_cylinder ball_bearing common_line cranfield_face)
parts=("${all_parts[@]:0:${PARTS:-8}}")
list=$(IFS=,; echo "${parts[*]}")
seeds=$(seq 1 "${SEEDS:-2}")
models=${MODELS:-S,C}
work=$target/slurm
rm -rf "$work"
mkdir -p "$work"/{state,spool-n1,spool-n2,log,munge,run}
chmod 700 "$work/munge"
say() { printf '%s %s\n' "$(date +%T)" "$*"; }
die() { echo "test-slurm: $*" >&2; tail -n 20 "$work"/log/*.log >&2 || true; exit 1; }

# Without it, Slurm's programs would ask another cluster's controller.
export SLURM_CONF=$work/slurm.conf

# Ends the processes of this script: first the tasks, then the daemons by the process ids in their files.
stop() {
    if [ -e "$SLURM_CONF" ]; then
        jobs=$(squeue --noheader --format %A 2>/dev/null | sort -u) || jobs=
        if [ -n "$jobs" ]; then
            scancel $jobs 2>/dev/null || true
            sleep 3
        fi
    fi
    for pid_file in "$work"/run/*.pid; do
        [ -e "$pid_file" ] && kill "$(cat "$pid_file")" 2>/dev/null || true
    done
}
trap stop EXIT

dd if=/dev/urandom of="$work/munge/key" bs=1024 count=1 status=none
chmod 400 "$work/munge/key"
munged --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/run/munged.pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed"

host=$(uname -n)
port=${SLURM_TEST_PORT:-17002}
cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
SlurmctldPort=$port
AuthType=auth/munge
# A requeued task waits as long as its credential is valid: two minutes by default.
AuthInfo=socket=$work/munge/socket,cred_expire=10
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool-%n
SlurmctldPidFile=$work/run/slurmctld.pid
SlurmdPidFile=$work/run/slurmd-%n.pid
SlurmctldLogFile=$work/log/slurmctld.log
SlurmdLogFile=$work/log/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
SlurmdTimeout=10
ReturnToService=2
KillWait=5
MpiDefault=none
SwitchType=switch/none
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 RealMemory=8000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 RealMemory=8000
PartitionName=p Nodes=n1,n2 Default=YES State=UP MaxTime=600
CONF
slurmctld -i || die "the controller does not start"
for node in n1 n2; do slurmd -N $node || die "the daemon of $node does not start"; done
for _ in $(seq 30); do
    [ "$(sinfo --noheader --format %A)" = 0/2 ] && break
    sleep 1
done
[ "$(sinfo --noheader --format %A)" = 0/2 ] || die "expected two idle nodes, found: $(sinfo --noheader)"
say "Slurm $(slurmd -V | cut -d ' ' -f 2) runs with two nodes"

sweep=(--models "$models" --objects "$list" --attempts 1 --views 1 --scenes 1 --steps "${STEPS:-2}")
for seed in $seeds; do
    # One unit cannot write its result, because a folder has the result's name until the unit has failed.
    if [ "$seed" = 1 ]; then
        mkdir -p "$work/1/cells/S-${parts[1]}.look.json"
    fi
    "$sdg" evaluate "${sweep[@]}" --seed "$seed" --out "$work/$seed" --cores 1 --memory-mb 3000 --limit-mins 120 \
        --submit slurm --yes
done
began=$(date +%s)
folders=$(for seed in $seeds; do echo "$work/$seed"; done)

# Prints the state of all folders in one line, and triggers the events.
killed= restarted= failed= node2_back=
while :; do
    sleep 2
    done_units=$(find $folders -path '*/units/*/done-*.json' | wc -l)
    say "$done_units units done; $(squeue --noheader --format %T 2>/dev/null | sort | uniq -c | tr -s ' \n' ' ')"
    look=$work/1/units/look-${parts[1]}
    if [ -z "$failed" ] && compgen -G "$look/failed-*.json" >/dev/null; then
        failed=$(compgen -G "$look/failed-*.json")
        say "the unit look-${parts[1]} failed as it should: $(grep '"why"' "$failed")"
        rmdir "$work/1/cells/S-${parts[1]}.look.json"
    fi
    if [ -z "$restarted" ] && [ "$done_units" -ge 3 ]; then
        # Not by SIGKILL: Slurm 22.05 writes its state every few seconds, and may start again a task whose state was not
        # written.
        controller=$(cat "$work/run/slurmctld.pid")
        say "the controller is ended (process $controller) and started again"
        kill "$controller"
        while kill -0 "$controller" 2>/dev/null; do sleep 0.2; done
        slurmctld || die "the controller does not start again"
        restarted=yes
    fi
    if [ -z "$killed" ] && [ "$done_units" -ge 5 ]; then
        # Only after a unit of this node has started.
        if grep -l '"host": "n2"' $work/*/units/*/running.json >"$work/at-work" 2>/dev/null; then
            say "the daemon of n2 is killed (process $(cat "$work/run/slurmd-n2.pid")) while at work: $(head -1 "$work/at-work")"
            kill -9 "$(cat "$work/run/slurmd-n2.pid")"
            killed=$(date +%s)
        fi
    fi
    if [ -n "$killed" ] && [ -z "$node2_back" ] && sinfo --noheader --Node --format '%N %T' 2>/dev/null | grep -q 'n2 down'; then
        say "n2 is down; its daemon is started again"
        slurmd -N n2
        node2_back=yes
    fi
    if [ -z "$(squeue --noheader 2>/dev/null)" ] && squeue --noheader >/dev/null 2>&1; then break; fi
    [ $(($(date +%s) - began)) -lt "${MAX_SECS:-7200}" ] || die "the sweep takes more than ${MAX_SECS:-7200} s"
done
took=$(($(date +%s) - began))
[ -n "$killed" ] && [ -n "$restarted" ] && [ -n "$failed" ] || die "not everything happened: killed=$killed restarted=$restarted failed=$failed"
node_of() { sed -n 's/.*"host": "\(.*\)".*/\1/p' "$1"; }
first=$(node_of "$failed") again=$(node_of "$(compgen -G "$look/done-*.json")")
[ "$first" != "$again" ] || die "look-${parts[1]} failed on $first and was tried again there"
say "look-${parts[1]} failed on $first and was done on $again"
grep -q "Requeuing\|requeue job\|due to failure of node n2" "$work/log/slurmctld.log" || die "no unit of n2 was put back"

for seed in $seeds; do
    say "collected: $("$sdg" evaluate "${sweep[@]}" --seed "$seed" --out "$work/$seed" --collect --json | head -c 100)..."
    "$sdg" evaluate --watch "$work/$seed" | head -1
    say "the same serially"
    "$sdg" evaluate "${sweep[@]}" --seed "$seed" --out "$work/serial-$seed" --jobs 1 >/dev/null 2>"$work/log/serial-$seed.log"
    python3 scripts/timeless-tables.py "$work/$seed" >"$work/shared-$seed.txt"
    python3 scripts/timeless-tables.py "$work/serial-$seed" >"$work/serial-$seed.txt"
    cmp "$work/shared-$seed.txt" "$work/serial-$seed.txt" || die "the tables of seed $seed differ"
    say "seed $seed: $(wc -c <"$work/shared-$seed.txt") bytes of tables are equal"
done
units=$(find $folders -path '*/units/*/done-*.json' | wc -l)
python3 - $folders <<PY
import glob, json, sys
receipts = [json.load(open(path)) for folder in sys.argv[1:] for path in glob.glob(folder + "/units/*/done-*.json")]
total = sum(receipt["seconds"] for receipt in receipts)
print(f"$units units took {total:.0f} s of work in $took s on two nodes: {100 * total / (2 * $took):.0f} % of two")
PY
say "passed"
