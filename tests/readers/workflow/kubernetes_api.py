"""As much of a Kubernetes API as Snakemake's executor asks for, on loopback: a job's container is a process in an empty folder,
as a pod begins without the files of who submitted it. Nothing of a real cluster is checked by it but what is sent."""

import http.server
import json
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

KUBECONFIG = """\
apiVersion: v1
kind: Config
clusters: [{{name: loopback, cluster: {{server: "http://127.0.0.1:{port}"}}}}]
users: [{{name: test, user: {{}}}}]
contexts: [{{name: test, context: {{cluster: loopback, user: test}}}}]
current-context: test
"""


class Kubernetes:
    """Listening between `with` and its end; `jobs` are the manifests of all jobs in their order."""

    def __init__(self, folder, environment):
        self.folder, self.jobs, self.pods = folder, [], {}
        # What an image has: Snakemake and its plugins, which `pip` therefore has not to bring.
        path = [str(folder / "bin"), os.path.dirname(sys.executable), os.environ["PATH"]]
        self.pod_environment = {**environment, "PATH": os.pathsep.join(path)}

    def __enter__(self):
        (self.folder / "bin").mkdir(parents=True)
        pip = self.folder / "bin/pip"
        pip.write_text("#!/bin/sh\n")
        pip.chmod(0o755)
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler(self))
        kubeconfig = self.folder / "kubeconfig"
        kubeconfig.write_text(KUBECONFIG.format(port=self.server.server_port))
        self.environment = {"KUBECONFIG": str(kubeconfig)}
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()
        for pod in self.pods.values():
            pod.kill()
            pod.wait()

    def begin(self, job):
        name = job["metadata"]["name"]
        container = job["spec"]["template"]["spec"]["containers"][0]
        work = Path(tempfile.mkdtemp(dir=self.folder, prefix="pod-"))
        log = open(work.with_suffix(".log"), "w")
        command = [*container["command"], *container["args"]]
        self.pods[name] = subprocess.Popen(command, cwd=work, env=self.pod_environment, stdout=log, stderr=log)
        self.jobs.append(job)

    def status(self, name):
        code = self.pods[name].poll()
        return {} if code is None else {"succeeded": 1} if code == 0 else {"failed": 1}


def handler(kubernetes):
    class Handler(http.server.BaseHTTPRequestHandler):
        def log_message(self, *_):
            pass

        def answer(self, document):
            content = json.dumps(document).encode()
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def do_POST(self):
            document = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if self.path.endswith("/jobs"):
                kubernetes.begin(document)
            self.answer(document)

        def do_GET(self):
            parts = self.path.split("?")[0].split("/")
            if "jobs" in parts:
                name = parts[parts.index("jobs") + 1]
                self.answer({"metadata": {"name": name}, "status": kubernetes.status(name)})
            else:
                self.answer({"items": []})

        def do_DELETE(self):
            self.answer({"status": "Success"})

    return Handler
