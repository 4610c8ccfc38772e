# SPDX-License-Identifier: BSD-3-Clause
# The page of allanite, or any of its commands, without rights and without a compiler: docs/howto/container.md
FROM python:3.13-slim AS build
RUN apt-get update \
    && apt-get install --yes --no-install-recommends g++ \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:3.13-slim
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    pip install --no-cache-dir "$(echo /wheels/allanite-*.whl)[all]"
RUN useradd --create-home --uid 10001 allanite \
    && install --directory --owner allanite /data
USER allanite
WORKDIR /data
EXPOSE 8080
ENTRYPOINT ["allanite"]
# Refuses to start without ALLANITE_TOKEN: other machines may reach it.
CMD ["serve", "/data", "--host", "0.0.0.0", "--port", "8080", "--no-browser"]
