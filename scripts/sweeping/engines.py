"""Where runs are done: processes of this machine, or an engine that exists (Dask) on as many machines as it has.

An engine is a function (jobs to do, count at a time, done) that calls done(record) in this process after every run.
"""
import concurrent.futures
import contextlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from . import one


class EngineError(Exception):
    pass


def local(todo, count, done):
    load = one.Load()
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        try:
            for future in concurrent.futures.as_completed([pool.submit(one.do, job, load) for job in todo]):
                done(future.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            one.end_all()
            raise


def dask(address):
    """Tasks of a Dask scheduler, its workers one run at a time each; without an address, a cluster on this machine.
    Workers need this folder and that of the runs under the same paths, and nothing but the standard library."""
    def engine(todo, count, done):
        try:
            from distributed import Client, LocalCluster, as_completed
        except ImportError as error:
            raise EngineError(f"--engine dask needs Dask ({error}): apt install python3-distributed") from None
        script = str(Path(one.__file__).resolve())
        # A cluster of our own lives in this process' folder of temporary files and prints nothing but faults.
        with contextlib.ExitStack() as stack:
            if not address:
                scratch = stack.enter_context(tempfile.TemporaryDirectory())
                cluster = stack.enter_context(LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None,
                                                           local_directory=scratch, silence_logs=50))
            try:
                client = stack.enter_context(Client(address or cluster, timeout="30s"))
            except OSError as error:
                raise EngineError(f"no Dask scheduler answers at {address}: {error}") from None
            # What is sent is a function of the standard library, so that workers need not import anything of ours.
            futures = [client.submit(subprocess.run, [sys.executable, script], input=json.dumps(job), text=True,
                                     capture_output=True, pure=False, priority=-number, retries=2)
                       for number, job in enumerate(todo)]
            for future, ended in as_completed(futures, with_results=True, raise_errors=True):
                if ended.returncode != 0:
                    raise EngineError(f"a worker could not do a run: {ended.stderr.strip()[-500:]}")
                done(json.loads(ended.stdout))
                future.release()
    return engine


def by_name(name):
    kind, _, address = name.partition(":")
    if kind == "local" and not address:
        return local
    if kind == "dask":
        return dask(address)
    raise EngineError(f"no engine '{name}'; there are: local, dask, dask:SCHEDULER-ADDRESS")
