# ensonify in a container, in two stages: the first makes the Debian packages, the second installs the
# program's. docker build -t ensonify . && docker run -v "$PWD:/work" ensonify run scene.toml
FROM debian:12 AS build
COPY . /ensonify
RUN cd /ensonify && ./dev package

FROM debian:12-slim
COPY --from=build /ensonify/build/packages/ensonify_*.deb /tmp/
RUN apt-get update \
 && apt-get install -qy --no-install-recommends /tmp/ensonify_*.deb python3-numpy \
 && rm -rf /tmp/*.deb /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["ensonify"]
