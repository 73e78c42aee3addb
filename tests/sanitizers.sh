#!/bin/sh
# Run the tests on an extension built with AddressSanitizer and UndefinedBehaviorSanitizer.
#
#     tests/sanitizers.sh [arguments of pytest]      all quick tests by default
#
# Every access out of bounds, use after free and undefined behaviour in hovi's own compiled code ends
# the process with a report. It takes a compiler of the GNU family, and the build dependencies in the
# environment of `python` (PYTHON=... for another one). The build stays in build/sanitizers.
set -eu

top=$(cd "$(dirname "$0")/.." && pwd)
python=${PYTHON:-python}
compiler=${CXX:-g++}
build=$top/build/sanitizers
package=$build/package

# One compiler at a time: a unit with Pinocchio's templates takes up to 3 GB.
cmake -S "$top/src/cpp" -B "$build" -G Ninja -DHOVI_SANITIZE=ON -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_COMPILER="$compiler" -DPython_EXECUTABLE="$(command -v "$python")"
cmake --build "$build" --parallel "${JOBS:-1}"

# The package with this extension, and the models beside it, as a wheel has them.
rm -rf "$package"
mkdir -p "$package"
cp -R "$top/src/hovi" "$package/hovi"
rm -f "$package"/hovi/_native/*.so
cp -R "$top/models" "$package/hovi/models"
cp "$build"/*.so "$package/hovi/_native/"

# CasADi opens its plugins with RTLD_DEEPBIND, which the sanitizer refuses.
cat >"$build/dlopen.c" <<'END'
#define _GNU_SOURCE
#include <dlfcn.h>
void *dlopen(const char *name, int flags) {
  void *(*next)(const char *, int) = (void *(*)(const char *, int))dlsym(RTLD_NEXT, "dlopen");
  return next(name, flags & ~RTLD_DEEPBIND);
}
END
"${CC:-cc}" -shared -fPIC -o "$build/libdlopen.so" "$build/dlopen.c" -ldl

# Python itself is not built with the sanitizer, so its library is loaded first; that of C++ too,
# since exceptions of other extensions pass through it.
preloaded="$build/libdlopen.so $("$compiler" -print-file-name=libasan.so)"
preloaded="$preloaded $("$compiler" -print-file-name=libstdc++.so)"
# pytest keeps what a process prints until it ends, so reports go to files.
reports=$build/report
rm -f "$reports".*
options=log_path=$reports:detect_leaks=0:verify_asan_link_order=0:allocator_may_return_null=1
export ASAN_OPTIONS="$options:${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="log_path=$reports:halt_on_error=1:print_stacktrace=1:${UBSAN_OPTIONS:-}"
export PYTHONPATH="$package${PYTHONPATH:+:$PYTHONPATH}"
export PYTHONMALLOC=malloc
cd "$top"
status=0
LD_PRELOAD=$preloaded "$python" -m pytest -p no:cacheprovider -q "$@" || status=$?
for report in "$reports".*; do
  [ -e "$report" ] || continue
  status=1
  echo "--- $report"
  head -n 30 "$report"
done
exit "$status"
