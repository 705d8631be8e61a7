"""Chain.run() against the command, threads, interrupts and the end of the interpreter."""
import contextlib
import resource
import signal
import threading
import time

import numpy
import postchain
import pytest
from conftest import BLUR, CAMERA, FXAA, bits, color_of_exr, command, expect_errors, planes_of, python

# A frame that is filtered for two minutes on one thread. computed() waits until the process has done so.
LONG = """
import numpy, postchain, sys, threading, time
postchain.set_threads(1)
device = postchain.Device("software")
chain = postchain.Chain({"postchain": 1, "passes": ["fxaa"] * 64})
color = numpy.random.default_rng(1).random((3072, 3072, 3), dtype=numpy.float32)
def computed():
    begin = time.process_time()
    while time.process_time() < begin + 0.5:
        time.sleep(0.01)
    print("ready", flush=True)
"""


def cpu_s():
    """Processor time of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_the_bits_of_the_command(frames, tmp_path):
    command("run", frames / "blur.yaml", "-i", frames / "frame.####.exr", "--camera",
            frames / "camera.json", "-o", tmp_path / "all.####.exr")
    # Alone in its folder, a frame has no neighbors.
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "frame.0002.exr").symlink_to(frames / "frame.0002.exr")
    command("run", frames / "blur.yaml", "-i", alone / "frame.####.exr", "--camera",
            frames / "camera.json", "-o", tmp_path / "one.####.exr")
    chain = postchain.Chain(BLUR)
    before, frame, after = (planes_of(number) for number in range(3))
    one = chain.run(**frame, camera=CAMERA, frame=2)
    all_three = chain.run(**frame, camera=CAMERA, frame=2, before=before, after=after)
    assert (bits(one) == bits(color_of_exr(tmp_path / "one.0002.exr"))).all()
    assert (bits(all_three) == bits(color_of_exr(tmp_path / "all.0002.exr"))).all()
    assert (bits(one) != bits(all_three)).any()
    first = chain.run(**before, camera=frames / "camera.json", frame=1,
                      after=postchain.Frame(**frame, camera=CAMERA, frame=2))
    assert (bits(first) == bits(color_of_exr(tmp_path / "all.0001.exr"))).all()


def test_wrong_neighbors():
    chain, frame = postchain.Chain(BLUR), planes_of(1)
    small = {name: plane[:-2] for name, plane in frame.items()}
    expect_errors((postchain.UsageError, words, lambda before=before: chain.run(
        **frame, camera=CAMERA, before=before)) for before, words in [
            (small, "before: is 48x30 pixels, the frame 48x32"),
            ({"color": frame["color"]}, "before: has no inverse_depth, motion"),
            ({"colour": frame["color"]}, "unknown plane 'colour'"), (frame["color"], "give a Frame, or a dict")])


def test_devices():
    with postchain.Device("software") as device:
        assert device.renderer
    device.close()  # once more
    expect_errors([
        (postchain.UsageError, "it is closed", lambda: postchain.Chain(FXAA).run(planes_of(0)["color"], device=device)),
        (postchain.UsageError, "device: 'fast'", lambda: postchain.Device("fast")),
        (postchain.DeviceError, "device 99 does not exist", lambda: postchain.Device(99)),
        (postchain.UsageError, "before the first run", lambda: postchain.set_threads(2)),
        *((postchain.UsageError, f"threads: {count} is not in", lambda count=count: postchain.set_threads(count))
          for count in (0, 1025))])


def test_a_device_that_closes_ends_what_waits_for_it():
    chain = postchain.Chain({"postchain": 1, "passes": ["fxaa"] * 8})
    color = numpy.random.default_rng(1).random((1024, 1024, 3), dtype=numpy.float32)
    device, ends = postchain.Device("software"), []
    threads = [threading.Thread(target=lambda: ends.append(chain.run(color, device=device).shape), daemon=True)
               for _ in range(3)]
    begin = time.process_time()
    for thread in threads:
        thread.start()
    while time.process_time() < begin + 0.5:
        time.sleep(0.01)
    device.close()
    for thread in threads:
        thread.join(60)
    assert ends == [color.shape] * 3


@pytest.mark.parametrize("own_device", [True, False])
def test_threads(own_device):
    chain, colors = postchain.Chain(FXAA), [planes_of(number)["color"] for number in (0, 1)]
    expected = [chain.run(color) for color in colors]
    results = []

    def work(which):
        with postchain.Device("software") if own_device else contextlib.nullcontext() as device:
            results.extend((bits(chain.run(colors[which], device=device)) == bits(expected[which])).all()
                           for _ in range(5))
    threads = [threading.Thread(target=work, args=(i % 2,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [True] * 20


def test_python_runs_while_a_frame_is_filtered():
    chain = postchain.Chain({"postchain": 1, "passes": ["fxaa"] * 16})
    color = numpy.random.default_rng(1).random((1024, 1024, 3), dtype=numpy.float32)
    chain.run(color[:64, :64])  # compiles
    thread = threading.Thread(target=chain.run, args=(color,))
    thread.start()
    ticks = 0
    while thread.is_alive():
        ticks += 1
        time.sleep(0.001)
    assert ticks > 10, "the GIL was held"


def test_keyboard_interrupt():
    before = cpu_s()
    process = python(LONG + """
try:
    threading.Thread(target=computed, daemon=True).start()
    chain.run(color, device=device)
except KeyboardInterrupt:
    small = postchain.Chain({"postchain": 1, "passes": ["fxaa"]}).run(color[:9, :9], device=device)
    print("interrupted", small.shape, flush=True)
""")
    assert process.stdout.readline() == "ready\n", process.communicate()[1]
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=900)
    assert out == "interrupted (9, 9, 3)\n" and process.returncode == 0, out + error
    assert cpu_s() - before < 60


def test_the_interpreter_exits_in_the_middle_of_a_run():
    before = cpu_s()
    process = python(LONG + """
threading.Thread(target=lambda: chain.run(color, device=device), daemon=True).start()
computed()
sys.exit(7)
""")
    out, error = process.communicate(timeout=900)
    assert process.returncode == 7 and out == "ready\n", (process.returncode, error)
    assert "Fatal" not in error and "terminate" not in error, error
    assert cpu_s() - before < 60


@pytest.mark.parametrize("attempt", range(4))  # each meets the wrong moment more often than not
def test_the_interpreter_exits_while_threads_close_devices(monkeypatch, attempt):
    monkeypatch.setenv("MALLOC_PERTURB_", "165")  # freed memory is overwritten
    process = python("""
import atexit, os, sys, threading, time
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
threads = []
atexit.register(lambda: [thread.join() for thread in threads])  # runs after postchain's
import numpy, postchain
chain, color = postchain.Chain({"postchain": 1, "passes": ["fxaa"]}), numpy.ones((64, 64, 3), "f4")
running = threading.Barrier(49)
def work(i):
    with postchain.Device("software") as device:
        chain.run(color, device=device)
        running.wait()
        try:
            while True:
                chain.run(color, device=device)
        except postchain.CanceledError:
            time.sleep(0.004 + 0.0005 * i)  # into the time in which postchain closes the devices
for i in range(48):
    threads.append(threading.Thread(target=work, args=(i,), daemon=True))
    threads[-1].start()
running.wait()
sys.exit(7)
""")
    out, error = process.communicate(timeout=300)
    assert (process.returncode, out) == (7, ""), (attempt, error)


def test_a_fork_is_refused():
    process = python("""
import os, sys, numpy, postchain
chain, color = postchain.Chain({"postchain": 1, "passes": ["fxaa"]}), numpy.ones((8, 8, 3), "f4")
chain.run(color)
child = os.fork()
if child == 0:
    try:
        chain.run(color)
    except postchain.UsageError as error:
        print(error.remedy, flush=True)
    del chain
    import atexit
    atexit._run_exitfuncs()
    sys.exit(3)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), chain.run(color).shape)
""")
    out, error = process.communicate(timeout=300)
    assert out == "use multiprocessing.set_start_method('spawn')\n3 (8, 8, 3)\n", out + error
