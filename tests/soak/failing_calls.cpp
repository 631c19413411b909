// Loaded before the C library (LD_PRELOAD), so that one call of the program fails, or its clock
// jumps. Settings come from the environment:
//   ENSONIFY_FAIL_CALL   the function: open, open_read, read, write, fsync, rename, mmap or malloc
//   ENSONIFY_FAIL_AT     which of its calls fails, from 1
//   ENSONIFY_FAIL_ERRNO  the error's number
//   ENSONIFY_CALLS_FILE  written at the end of the program: how many calls there were
//   ENSONIFY_CLOCK_JUMP  seconds by which the time of day jumps to and fro
// Calls count from the program's main() on: before, libraries initialise themselves.
// A call counts as `open` if it opens a file for writing, as `open_read` if it opens one for
// reading that is not the system's, as `mmap` only if it maps a file.
#include <initializer_list>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

constexpr const char* call_names[]{"open",  "open_read", "read", "write",
                                   "fsync", "rename",    "mmap", "malloc"};
enum Call {
  open_call,
  open_read_call,
  read_call,
  write_call,
  fsync_call,
  rename_call,
  mmap_call,
  malloc_call,
  none_call
};

// Plain globals: allocations come before any constructor.
std::atomic<long> calls{0};
std::atomic<bool> started{false};
long fail_at = -1;
int fail_errno = 0;
int clock_jump_s = 0;
Call fail_call = none_call;
const char* calls_file = nullptr;

long number(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::strtol(text, nullptr, 10) : 0;
}

__attribute__((constructor)) void read_settings() {
  fail_at = number("ENSONIFY_FAIL_AT");
  fail_errno = static_cast<int>(number("ENSONIFY_FAIL_ERRNO"));
  clock_jump_s = static_cast<int>(number("ENSONIFY_CLOCK_JUMP"));
  calls_file = std::getenv("ENSONIFY_CALLS_FILE");
  if (const char* call = std::getenv("ENSONIFY_FAIL_CALL"))
    for (int k = 0; k < none_call; ++k)
      if (std::strcmp(call, call_names[k]) == 0) fail_call = static_cast<Call>(k);
}

__attribute__((destructor)) void write_count() {
  if (!calls_file) return;
  fail_call = none_call;
  if (FILE* file = std::fopen(calls_file, "w")) {
    std::fprintf(file, "%ld\n", calls.load());
    std::fclose(file);
  }
}

using Main = int(int, char**, char**);
Main* program_main = nullptr;

/// The program's main(), from which on calls count.
int begin(int count, char** arguments, char** environment) {
  started = true;
  return program_main(count, arguments, environment);
}

/// Counts a call, and says whether it is the one that fails.
bool fails(Call call) {
  if (call != fail_call || !started || ++calls != fail_at) return false;
  errno = fail_errno;
  return true;
}

/// The C library's function of this name.
template <class F>
F* real(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

/// Whether opening a file fails. Libraries look for the system's files in several places.
bool opening_fails(const char* path, bool to_write) {
  if (to_write) return fails(open_call);
  for (const char* system : {"/dev/", "/etc/", "/lib", "/proc/", "/sys/", "/usr/"})
    if (std::strncmp(path, system, std::strlen(system)) == 0) return false;
  return fails(open_read_call);
}

bool to_write(int flags) { return (flags & (O_WRONLY | O_RDWR)) != 0; }
bool to_write(const char* mode) { return std::strpbrk(mode, "wa+") != nullptr; }

int open_as(const char* name, int folder, const char* path, int flags, va_list rest) {
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(rest, mode_t) : 0;
  if (opening_fails(path, to_write(flags))) return -1;
  return real<int(int, const char*, int, ...)>(name)(folder, path, flags, mode);
}

FILE* fopen_as(const char* name, const char* path, const char* mode) {
  if (opening_fails(path, to_write(mode))) return nullptr;
  return real<FILE*(const char*, const char*)>(name)(path, mode);
}

void* mmap_as(const char* name, void* at, size_t size, int protection, int flags, int file,
              off_t offset) {
  if (!(flags & MAP_ANONYMOUS) && fails(mmap_call)) return MAP_FAILED;
  return real<void*(void*, size_t, int, int, int, off_t)>(name)(at, size, protection, flags, file,
                                                                offset);
}

}  // namespace

extern "C" {

int __libc_start_main(Main* main, int count, char** arguments, void (*init)(), void (*finish)(),
                      void (*finish_loader)(), void* stack_end) {
  program_main = main;
  return real<decltype(__libc_start_main)>("__libc_start_main")(begin, count, arguments, init,
                                                                finish, finish_loader, stack_end);
}

int openat(int folder, const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = open_as("openat", folder, path, flags, rest);
  va_end(rest);
  return file;
}
int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = open_as("openat", AT_FDCWD, path, flags, rest);
  va_end(rest);
  return file;
}
int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = open_as("openat64", AT_FDCWD, path, flags, rest);
  va_end(rest);
  return file;
}
FILE* fopen(const char* path, const char* mode) { return fopen_as("fopen", path, mode); }
FILE* fopen64(const char* path, const char* mode) { return fopen_as("fopen64", path, mode); }

ssize_t read(int file, void* bytes, size_t size) {
  if (file > STDERR_FILENO && fails(read_call)) return -1;
  return real<ssize_t(int, void*, size_t)>("read")(file, bytes, size);
}
ssize_t pread(int file, void* bytes, size_t size, off_t at) {
  if (fails(read_call)) return -1;
  return real<ssize_t(int, void*, size_t, off_t)>("pread")(file, bytes, size, at);
}
ssize_t pread64(int file, void* bytes, size_t size, off64_t at) {
  if (fails(read_call)) return -1;
  return real<ssize_t(int, void*, size_t, off64_t)>("pread64")(file, bytes, size, at);
}

ssize_t write(int file, const void* bytes, size_t size) {
  if (file > STDERR_FILENO && fails(write_call)) return -1;
  return real<ssize_t(int, const void*, size_t)>("write")(file, bytes, size);
}
ssize_t writev(int file, const iovec* parts, int count) {
  if (file > STDERR_FILENO && fails(write_call)) return -1;
  return real<ssize_t(int, const iovec*, int)>("writev")(file, parts, count);
}
ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
  if (fails(write_call)) return -1;
  return real<ssize_t(int, const void*, size_t, off_t)>("pwrite")(file, bytes, size, at);
}
ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t at) {
  if (fails(write_call)) return -1;
  return real<ssize_t(int, const void*, size_t, off64_t)>("pwrite64")(file, bytes, size, at);
}

int fsync(int file) { return fails(fsync_call) ? -1 : real<int(int)>("fsync")(file); }
int fdatasync(int file) { return fails(fsync_call) ? -1 : real<int(int)>("fdatasync")(file); }
int syncfs(int file) { return fails(fsync_call) ? -1 : real<int(int)>("syncfs")(file); }
int rename(const char* from, const char* to) {
  return fails(rename_call) ? -1 : real<int(const char*, const char*)>("rename")(from, to);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  if (fails(rename_call)) return -1;
  return real<int(int, const char*, int, const char*)>("renameat")(from_folder, from, to_folder,
                                                                   to);
}

void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) {
  return mmap_as("mmap", at, size, protection, flags, file, offset);
}
void* mmap64(void* at, size_t size, int protection, int flags, int file, off64_t offset) {
  return mmap_as("mmap64", at, size, protection, flags, file, offset);
}

// dlsym allocates, so the C library's own other names of its allocator are used.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) { return fails(malloc_call) ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return fails(malloc_call) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  return fails(malloc_call) ? nullptr : __libc_realloc(old, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  return fails(malloc_call) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** made, size_t alignment, size_t size) {
  if (fails(malloc_call)) return ENOMEM;
  *made = __libc_memalign(alignment, size);
  return *made ? 0 : ENOMEM;
}

int clock_gettime(clockid_t clock, timespec* time) {
  static const auto get = real<int(clockid_t, timespec*)>("clock_gettime");
  static std::atomic<unsigned> count{0};
  const int result = get(clock, time);
  if (clock_jump_s && clock == CLOCK_REALTIME && result == 0)
    time->tv_sec += ++count % 2 ? clock_jump_s : -clock_jump_s;
  return result;
}

}  // extern "C"
