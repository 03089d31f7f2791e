"""Fails unless a second run of the smoke pipeline takes everything from the cache."""

import json
import subprocess
import sys
from pathlib import Path

command = [str(Path(sys.executable).with_name("hrcneuro")), "run", "pipelines/smoke.toml", "--workdir", sys.argv[1]]
items = json.loads(subprocess.run([*command, "--json"], stdout=subprocess.PIPE, check=True).stdout)["items"]
again = [f"{i['stage']} {i['unit']}: {i['state']}" for i in items if i["state"] != "hit"]
print(f"second run: {len(items) - len(again)} of {len(items)} units from the cache")
sys.exit("\n".join(again) or 0)
