"""A Slurm of one or more nodes on this machine, in a folder: munged, slurmctld and a slurmd for each node
on their own ports, independent of the machine's configuration. Needs root, as slurmd does."""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import time

PACKAGES = ["slurmctld", "slurmd", "slurm-client", "munge"]
PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel"]
failures = []


def check(holds, text):
    if not holds:
        failures.append(text)
        print("FAILED:", text)


def writers(out, is_program):
    """Processes that write below `out` and whose words is_program() accepts."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            command = (entry / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if is_program(command) and any(
                word.removeprefix(b"--output=").startswith(str(out).encode()) for word in command):
            found.append(int(entry.name))
    return found


class CannotStart(Exception):
    """Slurm cannot run on this machine."""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def program(name):
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


class Cluster:
    def __init__(self, folder, cores, nodes=1):
        missing = [name for name in PROGRAMS if not program(name)]
        if missing:
            raise CannotStart(f"not installed: {', '.join(missing)}")
        if os.geteuid() != 0:
            raise CannotStart("slurmd needs root")
        self.folder = pathlib.Path(folder).resolve()
        shutil.rmtree(self.folder, ignore_errors=True)
        self.names = [f"node{i + 1}" for i in range(nodes)]
        for name in ["munge", "state", *(f"spool.{node}" for node in self.names)]:
            (self.folder / name).mkdir(parents=True)
        self.processes = []
        self.nodes = {}
        self.environment = dict(os.environ, SLURM_CONF=str(self.folder / "slurm.conf"))
        try:
            self.start_munge()
            self.write_configuration(cores)
            self.start_controller()
            for node in self.names:
                self.start_node(node)
            self.wait_for(lambda: self.ask("scontrol", "show", "node", check=False).count("State=IDLE") == nodes,
                          f"the nodes did not come up: {self.folder}/slurmd.log")
        except (CannotStart, OSError, subprocess.SubprocessError) as error:
            self.stop()
            raise CannotStart(str(error)) from error

    def start(self, name, *words):
        log = open(self.folder / f"{name}.log", "ab")
        process = subprocess.Popen([program(name), *words], stdout=log, stderr=log,
                                   stdin=subprocess.DEVNULL, env=self.environment)
        self.processes.append(process)
        return process

    def start_controller(self):
        self.controller = self.start("slurmctld", "-D", "-f", self.environment["SLURM_CONF"])

    def restart_controller(self):
        """Ends slurmctld, and starts it with its saved state."""
        self.controller.terminate()
        self.controller.wait()
        self.start_controller()

    def start_munge(self):
        # The daemon refuses a socket in a folder that others can write to, and keys of other
        # owners.
        key = self.folder / "munge" / "key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        socket_path = self.folder / "munge" / "socket"
        self.start("munged", "--foreground", "--force", f"--key-file={key}",
                   f"--socket={socket_path}", f"--pid-file={self.folder}/munge/pid",
                   f"--seed-file={self.folder}/munge/seed", f"--log-file={self.folder}/munge/log")
        self.wait_for(socket_path.exists, "munged made no socket")

    def write_configuration(self, cores):
        host = socket.gethostname().split(".")[0]
        nodes = "".join(f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 "
                        f"Port={free_port()} CPUs={cores} State=UNKNOWN\n" for name in self.names)
        (self.folder / "slurm.conf").write_text(f"""\
ClusterName=postchain
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge/socket
CredType=cred/munge
SlurmctldPort={free_port()}
SlurmctldPidFile={self.folder}/slurmctld.pid
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool.%n
SlurmdPidFile={self.folder}/%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
SchedulerParameters=sched_min_interval=100000
ReturnToService=2
MpiDefault=none
{nodes}PartitionName=farm Nodes={",".join(self.names)} Default=YES MaxTime=INFINITE State=UP
""")

    def start_node(self, name):
        self.nodes[name] = self.start("slurmd", "-D", "-N", name, "-f",
                                      self.environment["SLURM_CONF"])

    def wait_for(self, holds, failure):
        end = time.monotonic() + 120
        while not holds():
            if time.monotonic() > end:
                raise CannotStart(failure)
            time.sleep(0.1)

    def ask(self, name, *words, check=True):
        return subprocess.run([program(name), *words], env=self.environment, check=check,
                              capture_output=True, text=True).stdout

    def submit(self, script, tasks, words, log):
        """Returns the array job's id."""
        text = self.ask("sbatch", "--parsable", f"--array=1-{tasks}", "--cpus-per-task=1",
                        f"--output={log}", str(script), *words)
        return int(text.split(";")[0])

    def states(self, job):
        """State of each task by its number: PENDING, RUNNING, COMPLETED, FAILED, ..."""
        states = {}
        for line in self.ask("scontrol", "show", "job", "-o", str(job)).splitlines():
            task = re.search(r"ArrayTaskId=(\S+)", line)
            state = re.search(r"JobState=(\S+)", line).group(1)
            # Pending tasks are grouped: ArrayTaskId=5-40.
            for part in task.group(1).split("%")[0].split(","):
                first, _, last = part.partition("-")
                for number in range(int(first), int(last or first) + 1):
                    states[number] = state
        return states

    def requeue(self, job, task):
        self.ask("scontrol", "requeue", f"{job}_{task}")
        # Otherwise it waits for two minutes.
        self.ask("scontrol", "update", f"JobId={job}_{task}", "StartTime=now", check=False)

    def kill_node(self, name):
        """Kills and restarts the node's daemon."""
        self.nodes[name].kill()
        self.nodes[name].wait()
        self.start_node(name)

    def stop(self):
        for process in reversed(self.processes):
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGTERM)
        for process in self.processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=10)
            process.kill()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
