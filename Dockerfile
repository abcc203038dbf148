# The tool, built from the sources beside this file and from the registries alone.
#
#     docker build -t seamwise .
#     docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" seamwise bake helmet.gltf -o out

FROM rust:1.95-slim-trixie AS build
# meshoptimizer and the encoder of KTX2 are C++.
RUN apt-get update && apt-get install -y --no-install-recommends g++ && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .
RUN cargo install --locked --path . --root /opt/seamwise
RUN /opt/seamwise/bin/seamwise man -o /opt/seamwise/share/man/man1
RUN mkdir -p /opt/seamwise/share/bash-completion/completions
RUN /opt/seamwise/bin/seamwise completions bash >/opt/seamwise/share/bash-completion/completions/seamwise

FROM debian:trixie-slim
COPY --from=build /opt/seamwise /usr/local
WORKDIR /work
ENTRYPOINT ["seamwise"]
CMD ["--help"]
