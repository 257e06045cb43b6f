"""HTTP service and command line, thin over routing and energy."""

import os
from importlib.metadata import PackageNotFoundError, version

# before numpy is imported: sums over several threads come out otherwise by their number, and the systems of a diagnosis
# are so small that threads wait for each other longer than they compute
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

try:
    VERSION = version("joulepath")
except PackageNotFoundError:  # run from a checkout that is not installed
    VERSION = "0+checkout"
