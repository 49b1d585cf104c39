# syntax=docker/dockerfile:1
# mfhca in a container: docker build -t mfhca-replay . && docker run --rm -v "$PWD:/data" mfhca-replay diagnose drive.mcap
FROM python:3.12-slim AS build

ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
WORKDIR /source
RUN python -m venv /opt/mfhca
# What the tool needs, at the locked versions; this layer stays while the lock does
COPY requirements.lock ./
RUN /opt/mfhca/bin/pip install --require-hashes -r requirements.lock
COPY pyproject.toml hatch_build.py README.md LICENSE CHANGELOG.md ./
COPY replay replay
COPY diagnosis diagnosis
COPY cli cli
COPY mfhca mfhca
RUN /opt/mfhca/bin/pip install --no-deps --no-build-isolation .

FROM python:3.12-slim

LABEL org.opencontainers.image.title="mfhca-replay" \
      org.opencontainers.image.description="Log replay and fault diagnosis for heavy-duty wheeled machines" \
      org.opencontainers.image.licenses="Apache-2.0"
COPY --from=build /opt/mfhca /opt/mfhca
ENV PATH=/opt/mfhca/bin:$PATH \
    NUMBA_CACHE_DIR=/var/cache/mfhca \
    OPENBLAS_NUM_THREADS=1
# Reports belong to the user of the folder: --user "$(id -u):$(id -g)" where that is not 1000
RUN useradd --uid 1000 --create-home mfhca \
 && install -d -o mfhca -g mfhca -m 1777 /var/cache/mfhca \
 && install -d -o mfhca -g mfhca /data
# By number, so that a cluster that demands a user without rights can tell
USER 1000
# The wheel brings the kernels; what it lacks, and what an older kind of processor needs, is compiled now and not in the first run
RUN mfhca simulate -o /tmp/warm.mcap --duration 20 --rate 100 -q \
 && mfhca diagnose /tmp/warm.mcap -o /tmp/warm -q --fail-on never \
 && rm -r /tmp/warm /tmp/warm.mcap /tmp/warm.truth.json \
 && chmod -R a+rwX /var/cache/mfhca
WORKDIR /data
ENTRYPOINT ["mfhca"]
CMD ["--help"]
