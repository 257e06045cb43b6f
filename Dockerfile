# syntax=docker/dockerfile:1
FROM python:3.12-slim AS builder
RUN python -m venv /opt/joulepath
ENV PATH=/opt/joulepath/bin:$PATH PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
WORKDIR /build
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
RUN pip wheel --no-index --no-deps --no-build-isolation --wheel-dir dist . && pip install --no-index --no-deps dist/*.whl

FROM python:3.12-slim
RUN useradd --system --create-home --uid 10001 joulepath
COPY --from=builder /opt/joulepath /opt/joulepath
ENV PATH=/opt/joulepath/bin:$PATH PYTHONUNBUFFERED=1
# graphs of one's own in graphs/ and stored vehicles; for PostgreSQL set JOULEPATH_DATABASE_URL and install the extra "postgresql"
RUN install --directory --owner joulepath /var/lib/joulepath
ENV XDG_DATA_HOME=/var/lib JOULEPATH_DATABASE_URL=sqlite:////var/lib/joulepath/vehicles.sqlite
# whoever reaches the container needs a key: `joulepath keys add NAME` in it makes one; or set JOULEPATH_OPEN_WITHOUT_KEYS=1
ENV JOULEPATH_KEYS_FILE=/var/lib/joulepath/keys.json
VOLUME /var/lib/joulepath
USER joulepath
WORKDIR /var/lib/joulepath
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=180s --retries=3 \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/healthz', timeout=4)"]
CMD ["joulepath", "serve", "--host", "0.0.0.0", "--port", "8000"]
