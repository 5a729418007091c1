"""A Slurm of two nodes on the loopback, of Debian's packages, without systemd: munged, slurmctld and two slurmd
as processes of this one, in a folder of their own and on ports of their own. Needs root, as slurmd does."""

import os
import pathlib
import secrets
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "sinfo")
NODES = ("n1", "n2")


def missing():
    """What keeps a cluster from running here, as a sentence; empty if nothing does."""
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    absent = [program for program in PROGRAMS if not shutil.which(program, path=path)]
    if absent:
        return (f"{', '.join(absent)} not found: install the Debian packages slurmctld, slurmd, slurm-client "
                "and munge")
    if os.geteuid() != 0:
        return "slurmd has to be started by root"
    return ""


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Cluster:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.processes = {}
        self.environment = dict(os.environ, SLURM_CONF=str(self.folder / "slurm.conf"),
                                PATH=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")

    def start(self):
        self._write_key()
        self._write_configuration()
        self._spawn("munged", ["munged", "--foreground", "--force", f"--key-file={self.folder}/munge.key",
                               f"--socket={self._socket()}", f"--pid-file={self.folder}/munged.pid",
                               f"--log-file={self.folder}/munged.log", f"--seed-file={self.folder}/munged.seed"])
        self._wait_for(lambda: self._socket().exists(), "munged has no socket")
        self.start_controller()
        for node in NODES:
            self.start_node(node)
        self._wait_for(lambda: self.idle_nodes() == len(NODES), "the nodes do not become idle")

    def start_controller(self):
        self._spawn("slurmctld", ["slurmctld", "-D", "-i", "-f", str(self.folder / "slurm.conf")])

    def start_node(self, node):
        self._spawn(node, ["slurmd", "-D", "-N", node, "-f", str(self.folder / "slurm.conf")])

    def describe(self):
        """What the controller says of its jobs and nodes, for messages."""
        return "".join(self.run(*words, check=False).stdout
                       for words in (("squeue", "-o", "%i %T %r %S"), ("sinfo", "-N", "-o", "%N %T %E")))

    def kill(self, name):
        """SIGKILL to munged's, the controller's or a node's daemon."""
        process = self.processes.pop(name)
        process.kill()
        process.wait()

    def stop(self):
        for name in (*NODES, "slurmctld", "munged"):
            process = self.processes.pop(name, None)
            if process:
                process.terminate()
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()

    def run(self, *words, check=True):
        return subprocess.run(words, env=self.environment, capture_output=True, text=True, check=check, timeout=60)

    def idle_nodes(self):
        result = self.run("sinfo", "-h", "-N", "-o", "%t", check=False)
        return sum(1 for state in result.stdout.split() if state == "idle")

    def jobs(self):
        """Lines of what is waiting or running; None where the controller does not answer."""
        result = self.run("squeue", "-h", "-o", "%i %T", check=False)
        return result.stdout.splitlines() if result.returncode == 0 else None

    def mend(self):
        """What an operator does after a controller's death: a task that it had started and whose start it did not live
        to note is started again, which its node refuses; Slurm holds the task and drains the node for that."""
        for line in self.run("squeue", "-h", "-t", "PENDING", "-o", "%A %r", check=False).stdout.splitlines():
            job, reason = line.split(" ", 1)
            if reason.endswith("held"):
                self.run("scontrol", "release", job, check=False)
        for line in self.run("sinfo", "-h", "-N", "-o", "%N %T", check=False).stdout.splitlines():
            node, state = line.split()
            if state.startswith("drain"):
                self.run("scontrol", "update", f"NodeName={node}", "State=RESUME", check=False)

    def spool(self, node):
        return self.folder / f"spool.{node}"

    def _socket(self):
        return self.folder / "munge.socket"

    def _write_key(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.folder.chmod(0o755)
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)

    def _write_configuration(self):
        controller, *ports = free_ports(1 + len(NODES))
        host = socket.gethostname()
        lines = [
            "ClusterName=loopback",
            f"SlurmctldHost={host}(127.0.0.1)",
            f"SlurmctldPort={controller}",
            "AuthType=auth/munge",
            # A requeued task waits until its old credential has expired, two minutes if nothing is said.
            f"AuthInfo=socket={self._socket()},cred_expire=10",
            "SlurmUser=root",
            "SlurmdUser=root",
            f"StateSaveLocation={self.folder}/state",
            f"SlurmdSpoolDir={self.spool('%n')}",
            f"SlurmctldPidFile={self.folder}/slurmctld.pid",
            f"SlurmdPidFile={self.folder}/%n.pid",
            f"SlurmctldLogFile={self.folder}/slurmctld.log",
            f"SlurmdLogFile={self.folder}/%n.log",
            "ProctrackType=proctrack/linuxproc",
            "TaskPlugin=task/none",
            "JobAcctGatherType=jobacct_gather/none",
            "SelectType=select/cons_tres",
            "SelectTypeParameters=CR_CPU",
            "MpiDefault=none",
            "ReturnToService=2",
            "JobRequeue=1",
            "BatchStartTimeout=3",  # after which a task that its node does not know is requeued
            "SlurmdTimeout=5",
            "SlurmctldTimeout=5",
            "MessageTimeout=5",
            "KillWait=2",
            "SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000,bf_interval=1",
        ]
        memory_mib = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") >> 20  # 1 where nothing is said
        for node, port in zip(NODES, ports):
            self.spool(node).mkdir(exist_ok=True)
            lines.append(f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 "
                         f"RealMemory={memory_mib} State=UNKNOWN")
        lines.append(f"PartitionName=all Nodes={','.join(NODES)} Default=YES MaxTime=INFINITE State=UP")
        (self.folder / "state").mkdir(exist_ok=True)
        (self.folder / "slurm.conf").write_text("\n".join(lines) + "\n")

    def _spawn(self, name, words):
        log = open(self.folder / f"{name}.out", "ab")
        self.processes[name] = subprocess.Popen(words, env=self.environment, stdin=subprocess.DEVNULL, stdout=log,
                                                stderr=log, start_new_session=True)

    def _wait_for(self, condition, problem, seconds=30):
        end = time.monotonic() + seconds
        while not condition():
            for name, process in self.processes.items():
                if process.poll() is not None:
                    raise RuntimeError(f"{name} ended: {(self.folder / (name + '.out')).read_text()[-2000:]}")
            if time.monotonic() > end:
                raise RuntimeError(problem)
            time.sleep(0.1)
