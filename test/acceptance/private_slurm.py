"""A Slurm of one node of its own, in a folder and on free ports: munged, slurmctld and slurmd of Debian, without systemd,
cgroups or rights."""
import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")

CONF = """
ClusterName=private
SlurmctldHost={host}
SlurmctldAddr=127.0.0.1
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmctldPidFile={top}/slurmctld.pid
SlurmdPidFile={top}/slurmd.pid
SlurmctldLogFile={top}/slurmctld.log
SlurmdLogFile={top}/slurmd.log
StateSaveLocation={top}/state
SlurmdSpoolDir={top}/spool
AuthType=auth/munge
AuthInfo=socket={top}/munge.socket,cred_expire=5
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=1,sched_interval=2,sched_min_interval=100000
SlurmdParameters=config_overrides
SlurmdTimeout=10
KillWait=2
MinJobAge=300
MaxArraySize={array}
ReturnToService=2
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=16000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def lacking():
    """What is not installed of what is needed."""
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    return [name for name in (*DAEMONS, "sbatch") if not shutil.which(name)]


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class PrivateSlurm:
    """As a context: daemons run, SLURM_CONF names this Slurm."""
    def __init__(self, top: Path, cpus=2, array=101):
        self.top, self.running = Path(top), {}
        for folder in ("state", "spool"):
            (self.top / folder).mkdir(parents=True)
        self.host = socket.gethostname().split(".")[0]
        user = subprocess.run(["id", "-un"], check=True, capture_output=True, text=True).stdout.strip()
        (self.top / "slurm.conf").write_text(
            CONF.format(host=self.host, user=user, top=self.top, cpus=cpus, array=array, ports=[free_port(), free_port()]))
        key = self.top / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        self.top.chmod(0o755)  # of a temporary folder; munged lets nobody else in

    def start(self, name):
        words = {"munged": ["--foreground", "--force", f"--key-file={self.top}/munge.key", f"--socket={self.top}/munge.socket",
                            f"--pid-file={self.top}/munged.pid", f"--seed-file={self.top}/munge.seed",
                            f"--log-file={self.top}/munged.log"],
                 "slurmctld": ["-D", "-f", f"{self.top}/slurm.conf"],
                 "slurmd": ["-D", "-N", self.host, "-f", f"{self.top}/slurm.conf"]}[name]
        with open(self.top / f"{name}.said", "a") as said:
            self.running[name] = subprocess.Popen([shutil.which(name), *words], stdout=said, stderr=said, cwd=self.top,
                                                  stdin=subprocess.DEVNULL)

    def kill(self, name, how=signal.SIGKILL):
        process = self.running.pop(name)
        process.send_signal(how)
        process.wait(timeout=60)

    def steps(self):
        """Processes of Slurm that hold this node's tasks, and the tasks' own."""
        held = [int(p.parent.name) for p in Path("/proc").glob("[0-9]*/cmdline") if b"slurmstepd: [" in read(p)]
        return [pid for pid in held if str(self.top).encode() in read(Path(f"/proc/{pid}/environ"))]

    def call(self, *words):
        return subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)

    def resume(self):
        """What an administrator does with a node that was drained."""
        if any(state.startswith(("down", "drain")) for state in self.call("sinfo", "--noheader", "--format=%t").stdout.split()):
            self.call("scontrol", "update", f"nodename={self.host}", "state=resume")

    def wait_until_up(self):
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if self.call("sinfo", "--noheader", "--format=%t").stdout.strip() in ("idle", "mix", "alloc", "comp"):
                return
            time.sleep(0.3)
        raise RuntimeError(f"Slurm does not begin: {self.call('sinfo').stdout}; logs in {self.top}")

    def __enter__(self):
        os.environ["SLURM_CONF"] = str(self.top / "slurm.conf")
        try:
            for name in DAEMONS:
                self.start(name)
                if name == "munged":
                    while not (self.top / "munge.socket").exists():
                        time.sleep(0.1)
            self.wait_until_up()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if len(self.running) == len(DAEMONS):
            self.call("scancel", "--state=PENDING", f"--user={os.getuid()}")
            self.call("scancel", f"--user={os.getuid()}")
            deadline = time.monotonic() + 20
            while time.monotonic() < deadline and self.call("squeue", "--noheader").stdout.strip():
                time.sleep(0.3)
        for pid in self.steps():
            os.kill(pid, signal.SIGKILL)
        for name in reversed(DAEMONS):
            if name in self.running:
                self.kill(name, signal.SIGTERM)
        del os.environ["SLURM_CONF"]


def read(path):
    try:
        return path.read_bytes()
    except OSError:
        return b""
