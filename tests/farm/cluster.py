"""A single-node Slurm in a folder: munged, slurmctld and slurmd on their own ports, independent of the
machine's configuration. Needs root, as slurmd does."""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel"]


class CannotStart(Exception):
    """Slurm cannot run on this machine."""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def program(name):
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


class Cluster:
    def __init__(self, folder, cores):
        missing = [name for name in PROGRAMS if not program(name)]
        if missing:
            raise CannotStart(f"not installed: {', '.join(missing)}")
        if os.geteuid() != 0:
            raise CannotStart("slurmd needs root")
        self.folder = pathlib.Path(folder).resolve()
        shutil.rmtree(self.folder, ignore_errors=True)
        for name in ["munge", "state", "spool"]:
            (self.folder / name).mkdir(parents=True)
        self.processes = []
        self.environment = dict(os.environ, SLURM_CONF=str(self.folder / "slurm.conf"))
        try:
            self.start_munge()
            self.write_configuration(cores)
            self.start("slurmctld", "-D", "-f", self.environment["SLURM_CONF"])
            self.start_node()
            self.wait_for_node()
        except (OSError, subprocess.SubprocessError) as error:
            self.stop()
            raise CannotStart(str(error)) from error
        except CannotStart:
            self.stop()
            raise

    def start(self, name, *words, **keys):
        log = open(self.folder / f"{name}.log", "ab")
        process = subprocess.Popen([program(name), *words], stdout=log, stderr=log,
                                   stdin=subprocess.DEVNULL, env=self.environment, **keys)
        self.processes.append(process)
        return process

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
        (self.folder / "slurm.conf").write_text(f"""\
ClusterName=postchain
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge/socket
CredType=cred/munge
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
SchedulerParameters=sched_min_interval=100000
ReturnToService=2
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=farm Nodes={host} Default=YES MaxTime=INFINITE State=UP
""")

    def start_node(self):
        self.node = self.start("slurmd", "-D", "-f", self.environment["SLURM_CONF"])

    def wait_for_node(self):
        self.wait_for(lambda: "State=IDLE" in self.ask("scontrol", "show", "node", check=False),
                      "the node did not come up: " + str(self.folder / "slurmd.log"))

    def wait_for(self, holds, failure, seconds=60):
        end = time.monotonic() + seconds
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

    def kill_node(self):
        """Kills and restarts the node's daemon."""
        self.node.kill()
        self.node.wait()
        self.start_node()

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
