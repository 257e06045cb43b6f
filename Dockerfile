# A digest makes the base the same each time: --build-arg PYTHON_IMAGE=docker.io/library/python:3.12-slim@sha256:…
# deploy/README.md says how to find it.
ARG PYTHON_IMAGE=docker.io/library/python:3.12-slim

FROM ${PYTHON_IMAGE} AS builder
RUN python -m venv /opt/joulepath
ENV PATH=/opt/joulepath/bin:$PATH PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
WORKDIR /build
# the PostgreSQL driver is among them
COPY requirements.lock .
RUN pip install --require-hashes --requirement requirements.lock
COPY pyproject.toml README.md LICENSE NOTICE ./
COPY joulepath joulepath
COPY app app
COPY proof proof
COPY reproduction reproduction
COPY diagnosis diagnosis
COPY routing routing
COPY energy energy
COPY data data
COPY web web
COPY docs docs
COPY CHANGELOG.md CONTRIBUTING.md ./
COPY deploy deploy
RUN python -m docs.manual
RUN pip wheel --no-index --no-deps --no-build-isolation --wheel-dir dist . && pip install --no-index --no-deps dist/*.whl

FROM ${PYTHON_IMAGE}
RUN groupadd --gid 10001 joulepath \
    && useradd --uid 10001 --gid joulepath --no-create-home --home-dir /var/lib/joulepath --shell /usr/sbin/nologin \
        joulepath \
    && install --directory --owner joulepath --group joulepath --mode 0750 \
        /var/lib/joulepath /var/lib/joulepath/graphs /var/lib/joulepath/cache
COPY --from=builder /opt/joulepath /opt/joulepath
# In the volume: graphs/ (graphs of one's own), vehicles.sqlite (unless JOULEPATH_DATABASE_URL names PostgreSQL) and
# cache/ (compiled kernels, which only fit the processor that they were made on), and keys.json: whoever reaches the
# container needs a key. `joulepath keys add NAME` in it makes one; JOULEPATH_OPEN_WITHOUT_KEYS=1 lets everybody in.
ENV PATH=/opt/joulepath/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    XDG_DATA_HOME=/var/lib \
    XDG_CACHE_HOME=/var/lib/joulepath/cache \
    JOULEPATH_KEYS_FILE=/var/lib/joulepath/keys.json \
    JOULEPATH_HOST=0.0.0.0 \
    JOULEPATH_PORT=8000
VOLUME /var/lib/joulepath
USER 10001
WORKDIR /var/lib/joulepath
EXPOSE 8000
# a first start compiles for some minutes and answers nothing meanwhile
HEALTHCHECK --interval=15s --timeout=5s --start-period=600s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f'http://127.0.0.1:{os.environ[\"JOULEPATH_PORT\"]}/readyz', timeout=4)"]
CMD ["joulepath", "serve"]
