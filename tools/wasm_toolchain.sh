#!/bin/sh
# A standard library for wasm32-unknown-unknown: tools/wasm_toolchain.sh [FOLDER]
#
# Prints the environment in which cargo finds it, to be eval'ed, with $WASM_FLAGS for cargo's command line.
# Where rustup can add the target, that is all. Elsewhere (no rustup, or no way to its server) Debian's web toolchain is
# unpacked into FOLDER, once, and cargo builds the standard library from its source. The packages are not installed: they
# conflict with rustup.
set -eu

if [ "${WASM_TOOLCHAIN:-}" != debian ] && command -v rustup >/dev/null &&
    timeout 300 rustup target add wasm32-unknown-unknown >/dev/null 2>&1; then
    echo "export WASM_FLAGS="
    exit
fi

folder=${1:-${XDG_CACHE_HOME:-$HOME/.cache}/truedepth/wasm}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
if [ ! -x "$folder/rustc" ]; then
    cd "$folder"
    apt-get update -q >/dev/null
    # All that rustc-web needs of the same source, and LLVM; names carry versions that change with Debian.
    depends() { apt-cache depends --important "$1" | sed -n 's/^ *Depends: \(lib.*\)/\1/p' | grep -E "$2"; }
    dev=$(depends rustc-web '^libstd-rust-web-dev')
    std=$(depends "$dev" '^libstd-rust-web-[0-9]')
    llvm=$(depends "$std" '^libllvm')
    apt-get download -q rustc-web rust-web-src "$dev" "$std" "$llvm" >/dev/null
    rm -rf root
    for deb in rustc-web_*.deb libstd-rust-web*.deb libllvm*.deb; do dpkg-deb -x "$deb" root; done
    # Of the source only library/ and what links to it.
    dpkg-deb --fsys-tarfile rust-web-src_*.deb | tar -x -C root --wildcards \
        './usr/src/rustc-*/library*' './usr/lib/rustlib/src*' './usr/lib/rustlib/rustc-src*' 2>/dev/null || true
    rm -f ./*.deb
    # Last, so that what was interrupted is begun again.
    printf '#!/bin/sh\nLD_LIBRARY_PATH=%s exec %s "$@"\n' \
        "$folder/root/usr/lib/x86_64-linux-gnu" "$folder/root/usr/bin/rustc" >rustc.part
    chmod +x rustc.part
    mv rustc.part rustc
fi
echo "export RUSTC=$folder/rustc RUSTC_BOOTSTRAP=1 WASM_FLAGS=-Zbuild-std=std,panic_abort"
