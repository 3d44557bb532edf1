import importlib.util
import os
import subprocess
import sys

import pytest
from horf_cli.backends import make_backend
from horf_cli.exit_codes import CliError

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("ray") is None, reason="the extra horf[ray] is not installed"
)

# Ray is imported in a process of its own: it reads its environment when it is imported.
OWN_CLUSTER = """
import json
import sys
from pathlib import Path

import jobs_for_ray
from horf_cli.backends import make_backend


def listening():
    lines = [
        line.split()
        for name in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
    ]
    return {line[1] for line in lines if line[3] == "0A"}


before, seen, found = listening(), set(), {}
for outcome in make_backend("ray", workers=2).run(jobs_for_ray.fail_on_three, [2, 3, 4]):
    seen |= listening()
    found[outcome.index] = [outcome.result, outcome.error]
print(json.dumps({"hosts": sorted({a.split(":")[0] for a in seen - before}), "found": found}))
"""

TWO_NODES = """
import json
import sys
import threading
import time
from pathlib import Path

from ray.cluster_utils import Cluster

import jobs_for_ray
from horf_cli.backends import make_backend

folder = Path(sys.argv[1])
cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
second = cluster.add_node(num_cpus=1)


def kill_the_second_node():
    # As soon as both nodes are at work.
    while len({path.name.split("-")[1] for path in folder.glob("*-*")}) < 2:
        time.sleep(0.05)
    cluster.remove_node(second, allow_graceful=False)


killer = threading.Thread(target=kill_the_second_node)
killer.start()
jobs = [(str(folder), k, second.node_id) for k in range(3)]
backend = make_backend("ray", workers=1, address=cluster.address)
outcomes = list(backend.run(jobs_for_ray.wait_on_a_doomed_node, jobs))
killer.join()
cluster.shutdown()
print(json.dumps({"outcomes": [[o.index, o.result, o.error] for o in outcomes],
                  "doomed": second.node_id}))
"""

JOBS = """
import time
from pathlib import Path


def fail_on_three(number):
    if number == 3:
        raise ValueError(f"three\\\\nis {number}")
    return number


def wait_on_a_doomed_node(job):
    import ray

    folder, number, doomed = job
    node = ray.get_runtime_context().get_node_id()
    Path(folder, f"{number}-{node}").touch()
    while node == doomed:
        time.sleep(0.1)
    time.sleep(0.3)
    return node
"""


def run(program, folder):
    """Run a program with the jobs in its path; the last line that it prints."""
    (folder / "jobs_for_ray.py").write_text(JOBS.replace("\\\\n", "\\n"))
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", program, folder],
        env={**os.environ, "PYTHONPATH": path, "RAY_USAGE_STATS_ENABLED": "0"},
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    import json

    return json.loads(done.stdout.splitlines()[-1])


def test_a_cluster_of_its_own_runs_jobs_and_listens_on_loopback_only(tmp_path):
    answer = run(OWN_CLUSTER, tmp_path)
    assert answer["found"]["0"] == [2, ""]
    assert answer["found"]["2"] == [4, ""]
    assert answer["found"]["1"] == [None, "ValueError: three is 3"]
    loopback = {"0100007F", "00000000000000000000000001000000", "0000000000000000FFFF00000100007F"}
    assert answer["hosts"]
    assert set(answer["hosts"]) <= loopback


def test_a_job_whose_node_dies_is_moved_to_another(tmp_path):
    answer = run(TWO_NODES, tmp_path)
    outcomes = {index: (node, error) for index, node, error in answer["outcomes"]}
    assert sorted(outcomes) == [0, 1, 2]
    assert all(node and node != answer["doomed"] and not error for node, error in outcomes.values())
    begun = [path.name.split("-") for path in tmp_path.glob("[0-9]-*")]
    moved = {number for number, node in begun if node == answer["doomed"]}
    assert moved
    assert all([number, outcomes[int(number)][0]] in begun for number in moved)


def test_no_cluster_at_an_address_is_an_error_with_the_address():
    backend = make_backend("ray", workers=1, address="127.0.0.1:1")
    with pytest.raises(CliError, match=r"no Ray cluster at 127\.0\.0\.1:1"):
        list(backend.run(len, ["x"]))
