"""A Slurm of one node from Debian's packages: no systemd, no service of the machine, no file outside its folder. It runs in
namespaces of its own whose only network is loopback, whose host is called localhost and whose /etc/slurm is the folder: it reaches
nobody, nobody reaches it, and no variable has to tell its commands where it is."""

import os
import shutil
import subprocess

from cohort import PATIENCE, comes

PROGRAMS = {"slurmctld": "slurm-wlm", "slurmd": "slurm-wlm", "munged": "munge", "unshare": "util-linux", "nsenter": "util-linux"}
NAMESPACES = ["--net", "--uts", "--mount"]
CONF = """\
ClusterName=loopback
SlurmctldHost=localhost(127.0.0.1)
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmctldPort=6817
SlurmdPort=6818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SlurmdParameters=config_overrides
# Other work on the machine makes messages slow; jobs that ended are asked for at the end of a test.
MessageTimeout=100
MinJobAge=36000
ReturnToService=2
KillWait=2
NodeName=localhost NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory} State=UNKNOWN
PartitionName=test Nodes=localhost Default=YES MaxTime=60 State=UP
"""


def where(program):
    """A program; the daemons lie in /usr/sbin, which is not on everybody's path."""
    found = shutil.which(program) or shutil.which(program, path="/usr/sbin:/sbin")
    if not found:
        raise FileNotFoundError(f"{program} is missing: apt-get install {PROGRAMS[program]}")
    return found


class NoNamespaces(Exception):
    """For other users than root, and in containers without rights."""


class Slurm:
    """Running between `with` and its end; its commands are run `inside`."""

    def __init__(self, folder, cpus=2, memory=8000):
        self.folder, self.cpus, self.memory = folder, cpus, memory
        self.holder, self.daemons = None, []

    def __enter__(self):
        for name in ("etc", "state", "spool"):
            (self.folder / name).mkdir(parents=True)
        (self.folder / "munge.key").write_bytes(os.urandom(128))
        (self.folder / "munge.key").chmod(0o600)
        conf = CONF.format(folder=self.folder, cpus=self.cpus, memory=self.memory)
        (self.folder / "etc/slurm.conf").write_text(conf)
        try:
            self.start_namespaces()
            own = [f"--{key}-file={self.folder}/munge.{end}" for key, end in
                   (("key", "key"), ("pid", "pid"), ("log", "log"), ("seed", "seed"))]
            self.start([where("munged"), "--foreground", "--force", f"--socket={self.folder}/munge.socket", *own])
            self.until(lambda: (self.folder / "munge.socket").exists(), "munged")
            self.start([where("slurmctld"), "-D"])
            self.start([where("slurmd"), "-D", "-N", "localhost"])
            self.until(lambda: "idle" in self.ask("sinfo", "-h", "-o", "%T"), "the node")
        except BaseException:
            self.__exit__()
            raise
        return self

    def start_namespaces(self):
        """Holds the namespaces open by a process that sleeps in them."""
        # A second address of loopback: the resolver takes a host that has 127.0.0.1 alone for one without network.
        up = "ip link set lo up && ip address add 127.0.0.2/8 dev lo && hostname localhost "
        up += f"&& mount --bind '{self.folder}/etc' /etc/slurm && echo up && exec sleep infinity"
        command = [where("unshare"), *NAMESPACES, "sh", "-c", up]
        self.holder = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        if self.holder.stdout.readline() != "up\n":
            raise NoNamespaces("no namespaces here: a Slurm on loopback alone needs root")

    def inside(self, command):
        """A command as it is run where Slurm is."""
        # By its way: entering a mount namespace leaves the working folder behind.
        return [where("nsenter"), f"--wd={os.getcwd()}", "--target", str(self.holder.pid), *NAMESPACES, "--", *command]

    def start(self, command):
        log = open(self.folder / f"{os.path.basename(command[0])}.out", "w")
        self.daemons.append(subprocess.Popen(self.inside(command), stdout=log, stderr=log))

    def ask(self, *command):
        done = subprocess.run(self.inside(command), capture_output=True, text=True, timeout=PATIENCE)
        return done.stdout

    def until(self, ready, what):
        def ready_or_dead():
            dead = [daemon.args[-1] for daemon in self.daemons if daemon.poll() is not None]
            if dead:
                raise RuntimeError(f"{dead[0]} ended, see {self.folder}")
            return ready()

        if not comes(ready_or_dead):
            raise TimeoutError(f"{what} is not up after {PATIENCE} s, see {self.folder}")

    def __exit__(self, *_):
        if len(self.daemons) == 3:
            self.ask("scancel", "--me", "--signal=KILL", "--full")
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in self.daemons:
            try:
                daemon.wait(60)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        if self.holder:
            self.holder.terminate()
            self.holder.wait()
