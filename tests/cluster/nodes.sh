# A Slurm of one machine with two emulated nodes, n1 and n2, each of one processor, without systemd: sourced by the
# tests of clusters, as root. Everything, the key of munge included, lies in one folder; /etc and a Slurm that may run
# on the machine are left alone.

# Installs what is missing with apt. Fails where that is not possible.
cluster_install() {
    command -v slurmctld >/dev/null && command -v slurmd >/dev/null && command -v munged >/dev/null && return 0
    command -v apt-get >/dev/null || { echo "error: Slurm and munge are not installed, and there is no apt-get to install them" >&2; return 1; }
    echo "installing slurm-wlm and munge" >&2
    { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends slurm-wlm munge; } >"$1" 2>&1 ||
        { tail -5 "$1" >&2; echo "error: apt-get cannot install slurm-wlm and munge" >&2; return 1; }
}

# Starts the cluster in folder $1, which everybody must be able to enter.
cluster_up() {
    CLUSTER=$1
    local host port_c port_1 port_2
    host=$(hostname -s)
    mkdir -p "$CLUSTER"/{munge,state,spool-n1,spool-n2,log}
    # munge lets everybody reach its socket and nobody but its user its key
    chmod 755 "$CLUSTER" "$CLUSTER/munge"
    (umask 077 && head -c 128 /dev/urandom >"$CLUSTER/munge/key")
    munged --socket="$CLUSTER/munge/socket" --key-file="$CLUSTER/munge/key" --pid-file="$CLUSTER/munge/pid" \
        --log-file="$CLUSTER/log/munged.log" --seed-file="$CLUSTER/munge/seed" || return 1
    read -r port_c port_1 port_2 < <(python3 -c '
import socket
held = [socket.create_server(("127.0.0.1", 0)) for _ in range(3)]
print(*(s.getsockname()[1] for s in held))')
    cat >"$CLUSTER/slurm.conf" <<CONF
ClusterName=afmid
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port_c
AuthType=auth/munge
# a task of a lost node may start again after cred_expire seconds (120 where nothing is set)
AuthInfo=socket=$CLUSTER/munge/socket,cred_expire=5
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$CLUSTER/state
SlurmdSpoolDir=$CLUSTER/spool-%n
SlurmctldPidFile=$CLUSTER/slurmctld.pid
SlurmdPidFile=$CLUSTER/slurmd-%n.pid
SlurmctldLogFile=$CLUSTER/log/slurmctld.log
SlurmdLogFile=$CLUSTER/log/slurmd-%n.log
# a node that is silent for so long is lost (300 where nothing is set)
SlurmdTimeout=6
SlurmctldTimeout=30
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,bf_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
JobRequeue=1
MinJobAge=3600
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$port_1 CPUs=1 RealMemory=1000 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$port_2 CPUs=1 RealMemory=1000 State=UNKNOWN
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$CLUSTER/slurm.conf
    slurmctld -c && slurmd -N n1 && slurmd -N n2 || return 1
    local try
    for try in $(seq 60); do
        [ "$(timeout 5 sinfo -h -N -o %t 2>/dev/null | grep -c idle)" = 2 ] && return 0
        sleep 0.5
    done
    timeout 5 sinfo -N >&2 || true
    tail -3 "$CLUSTER"/log/*.log >&2
    echo "error: the two nodes do not come up (try $try)" >&2
    return 1
}

# Process numbers of the tasks on node $1 and of the Slurm steps above them. Processes may end while one looks: what is
# gone is passed over.
node_tasks() {
    local pid parent
    { grep -lzx "SLURMD_NODENAME=$1" /proc/[0-9]*/environ | xargs -r grep -lzxF "SLURM_CONF=$SLURM_CONF"; } 2>/dev/null |
        while IFS=/ read -r _ _ pid _; do
            parent=$(awk '$1 == "PPid:" { print $2 }' "/proc/$pid/status" 2>/dev/null) || continue
            [ "$(cat "/proc/$parent/comm" 2>/dev/null)" != slurmstepd ] || echo "$parent"
            echo "$pid"
        done | sort -un || true
}

# Node $1 vanishes as if its power failed: daemon first, so that it reports nothing, then steps and tasks.
node_kill() {
    local tasks
    kill -9 "$(cat "$CLUSTER/slurmd-$1.pid")"
    tasks=$(node_tasks "$1")
    [ -z "$tasks" ] || kill -9 $tasks 2>/dev/null || true
}

# Stops what cluster_up started.
cluster_down() {
    [ -n "${CLUSTER:-}" ] || return 0
    timeout 10 scancel -u root 2>/dev/null || true
    local node pid tasks
    for node in n1 n2; do
        tasks=$(node_tasks "$node")
        [ -z "$tasks" ] || kill -9 $tasks 2>/dev/null || true
    done
    for pid in "$CLUSTER"/slurmd-n1.pid "$CLUSTER"/slurmd-n2.pid "$CLUSTER/slurmctld.pid" "$CLUSTER/munge/pid"; do
        [ ! -s "$pid" ] || kill "$(cat "$pid")" 2>/dev/null || true
    done
}
