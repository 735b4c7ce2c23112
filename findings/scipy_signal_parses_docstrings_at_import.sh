#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# scipy 1.17.1: "import scipy.signal" parses and rewrites the docstrings of some five hundred functions, to put a note about array
# backends into each; in 1.14.1 it was some fifty. For a program on the command line that needs one Butterworth filter this is
# most of a second before it does anything. "python -OO", which drops docstrings, changes nothing.
# What helps: import scipy.signal only in the verbs that filter.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/count.py" <<'PYTHON'
import sys

import scipy
import scipy.interpolate

parsed = 0


def watch(frame, event, arg):
    global parsed
    code = frame.f_code
    parsed += event == "call" and code.co_name == "_parse" and "docscrape" in code.co_filename


sys.setprofile(watch)
import scipy.signal

sys.setprofile(None)
print(f"scipy {scipy.__version__}, optimize={sys.flags.optimize}: {parsed} docstrings parsed by import scipy.signal")
least, most = int(sys.argv[1]), int(sys.argv[2])
assert least <= parsed <= most
PYTHON
for version in 1.14.1 1.17.1; do
    python3 -m venv "$folder/$version"
    "$folder/$version/bin/python" -m pip --quiet --disable-pip-version-check install "scipy==$version" "numpy==2.2.6"
done
"$folder/1.14.1/bin/python" "$folder/count.py" 0 100
"$folder/1.17.1/bin/python" "$folder/count.py" 300 2000
"$folder/1.17.1/bin/python" -OO "$folder/count.py" 300 2000
