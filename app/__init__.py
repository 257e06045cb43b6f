"""HTTP service and command line, thin over routing and energy."""

from importlib.metadata import PackageNotFoundError, version

try:
    VERSION = version("joulepath")
except PackageNotFoundError:  # run from a checkout that is not installed
    VERSION = "0+checkout"
