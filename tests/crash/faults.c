/* A library for LD_PRELOAD that counts the operations on files under a folder and lets one of them
 * fail. The environment says what to do:
 *
 *   FAULT_ROOT  the folder; operations on other files pass
 *   FAULT_LOG   file to which every operation is written, one line each: operation and path
 *   FAULT_TRACE file to which every operation that succeeded is written with all that it did, for
 *               the simulation of a loss of power: operation, offset, length, path and second path,
 *               separated by tabs, and after the line as many bytes as a write wrote
 *   FAULT_AT    number of the operation that fails, from 1; 0 or nothing: none
 *   FAULT_KIND  kill: the process dies before the operation
 *               torn: it dies after half of a write, before any other operation
 *               short: a write takes half of the bytes; other operations pass
 *               eio: the operation fails with EIO
 *               full: it and every later one that needs room fails with ENOSPC
 *
 * Only what changes files is counted: opening for writing, writing, syncing, renaming and so on.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_long operations;
static atomic_int disk_is_full;

enum action { PASS, HALF, HALF_THEN_DIE, FAIL };

__attribute__((noreturn)) static void die(void) {
    syscall(SYS_kill, (long)getpid(), (long)SIGKILL);
    for (;;) pause();
}

static int is(const char *kind) {
    const char *wanted = getenv("FAULT_KIND");
    return wanted && strcmp(wanted, kind) == 0;
}

/* Decides about an operation on `path`; sets errno if it is to fail. */
static enum action decide(const char *operation, const char *path, int is_write, int needs_room) {
    const char *root = getenv("FAULT_ROOT");
    if (!root || strncmp(path, root, strlen(root)) != 0) return PASS;
    long number = atomic_fetch_add(&operations, 1) + 1;
    const char *log = getenv("FAULT_LOG");
    if (log) {
        char line[4200];
        int length = snprintf(line, sizeof line, "%s %s\n", operation, path);
        long fd = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
        syscall(SYS_write, fd, line, (size_t)length);
        syscall(SYS_close, fd);
    }
    const char *at = getenv("FAULT_AT");
    if (atomic_load(&disk_is_full) && needs_room) {
        errno = ENOSPC;
        return FAIL;
    }
    if (!at || number != atol(at)) return PASS;
    if (is("kill")) die();
    if (is("torn")) {
        if (!is_write) die();
        return HALF_THEN_DIE;
    }
    if (is("short")) return is_write ? HALF : PASS;
    if (is("full")) {
        atomic_store(&disk_is_full, 1);
        if (!needs_room) return PASS;
        errno = ENOSPC;
        return FAIL;
    }
    errno = EIO;
    return FAIL;
}

/* Appends a record to the trace. Operations under way in other threads come before or after. */
static void trace(const char *operation, off_t offset, const char *path, const char *second, const struct iovec *parts,
                  int count, size_t length) {
    static atomic_flag busy = ATOMIC_FLAG_INIT;
    const char *file = getenv("FAULT_TRACE"), *root = getenv("FAULT_ROOT");
    if (!file || !root || strncmp(path, root, strlen(root)) != 0) return;
    int saved = errno;
    char line[9000];
    int size = snprintf(line, sizeof line, "%s\t%lld\t%zu\t%s\t%s\n", operation, (long long)offset, length, path, second);
    while (atomic_flag_test_and_set(&busy)) {}
    long fd = syscall(SYS_openat, AT_FDCWD, file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    syscall(SYS_write, fd, line, (size_t)size);
    for (int part = 0; part < count && length > 0; part++) {
        size_t bytes = parts[part].iov_len < length ? parts[part].iov_len : length;
        syscall(SYS_write, fd, parts[part].iov_base, bytes);
        length -= bytes;
    }
    syscall(SYS_close, fd);
    atomic_flag_clear(&busy);
    errno = saved;
}

static int path_of(int fd, char *path, size_t size) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, size - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return 1;
}

static void trace_file(const char *operation, int fd, off_t offset) {
    char path[4096];
    if (path_of(fd, path, sizeof path)) trace(operation, offset, path, "", NULL, 0, 0);
}

static ssize_t trace_write(int fd, const struct iovec *parts, int count, ssize_t written) {
    char path[4096];
    if (written > 0 && getenv("FAULT_TRACE") && path_of(fd, path, sizeof path)) {
        off_t end = lseek(fd, 0, SEEK_CUR);
        trace("write", end - written, path, "", parts, count, (size_t)written);
    }
    return written;
}

/* The path of a name relative to an open folder. */
static const char *resolve(int folder, const char *name, char *buffer, size_t size) {
    if (name[0] == '/') return name;
    char link[64];
    if (folder == AT_FDCWD) snprintf(link, sizeof link, "/proc/self/cwd");
    else snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
    ssize_t length = readlink(link, buffer, size - 1);
    if (length < 0) return name;
    snprintf(buffer + length, size - (size_t)length, "/%s", name);
    return buffer;
}

static enum action on_name(const char *operation, int folder, const char *name, int needs_room) {
    char buffer[4096];
    return decide(operation, resolve(folder, name, buffer, sizeof buffer), 0, needs_room);
}

static enum action on_file(const char *operation, int fd, int is_write) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return PASS;
    path[length] = 0;
    return decide(operation, path, is_write, is_write);
}

static int open_at(int folder, const char *name, int flags, va_list arguments) {
    int makes = (flags & O_CREAT) || (flags & O_TMPFILE) == O_TMPFILE;
    mode_t mode = makes ? va_arg(arguments, mode_t) : 0;
    int changes = flags & (O_CREAT | O_TRUNC | O_WRONLY | O_RDWR);
    if (changes && on_name("open", folder, name, flags & O_CREAT) == FAIL) return -1;
    int is_new = (flags & O_CREAT) && faccessat(folder, name, F_OK, AT_SYMLINK_NOFOLLOW) != 0;
    int fd = (int)syscall(SYS_openat, folder, name, flags, mode);
    if (fd >= 0 && is_new) trace_file("create", fd, 0);
    else if (fd >= 0 && (flags & O_TRUNC)) trace_file("truncate", fd, 0);
    return fd;
}

#define OPEN(symbol, ...) \
    int symbol(__VA_ARGS__ const char *name, int flags, ...) { \
        va_list arguments; \
        va_start(arguments, flags); \
        int fd = open_at(FOLDER, name, flags, arguments); \
        va_end(arguments); \
        return fd; \
    }
#define COMMA ,
#define FOLDER AT_FDCWD
OPEN(open, )
OPEN(open64, )
#undef FOLDER
#define FOLDER folder
OPEN(openat, int folder COMMA)
OPEN(openat64, int folder COMMA)

ssize_t write(int fd, const void *bytes, size_t count) {
    struct iovec part = {(void *)bytes, count};
    switch (on_file("write", fd, 1)) {
    case FAIL: return -1;
    case HALF: return syscall(SYS_write, fd, bytes, count > 1 ? count / 2 : count);
    case HALF_THEN_DIE: syscall(SYS_write, fd, bytes, count / 2); die();
    default: return trace_write(fd, &part, 1, syscall(SYS_write, fd, bytes, count));
    }
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
    switch (on_file("write", fd, 1)) {
    case FAIL: return -1;
    case HALF: return syscall(SYS_writev, fd, parts, count > 1 ? count / 2 : count);
    case HALF_THEN_DIE: syscall(SYS_writev, fd, parts, count / 2); die();
    default: return trace_write(fd, parts, count, syscall(SYS_writev, fd, parts, count));
    }
}

#define ON_FILE(symbol, parameters, traced, offset, call) \
    int symbol parameters { \
        if (on_file(#symbol, fd, 0) == FAIL) return -1; \
        int result = (int)syscall call; \
        if (result == 0) trace_file(traced, fd, offset); \
        return result; \
    }
/* Nobody waits for the disk: a loss of power is simulated from the trace. */
#define SYNC(symbol) \
    int symbol(int fd) { \
        if (on_file(#symbol, fd, 0) == FAIL) return -1; \
        trace_file("sync", fd, 0); \
        return 0; \
    }
SYNC(fsync)
SYNC(fdatasync)
ON_FILE(ftruncate, (int fd, off_t length), "truncate", length, (SYS_ftruncate, fd, length))
ON_FILE(ftruncate64, (int fd, off64_t length), "truncate", length, (SYS_ftruncate, fd, length))
ON_FILE(fchmod, (int fd, mode_t mode), "mode", 0, (SYS_fchmod, fd, mode))

static int trace_name(int result, const char *operation, int folder, const char *name, const char *from) {
    char buffer[4096], second[4096];
    if (result == 0)
        trace(operation, 0, resolve(folder, name, buffer, sizeof buffer),
              from ? resolve(AT_FDCWD, from, second, sizeof second) : "", NULL, 0, 0);
    return result;
}

#define ON_NAME(symbol, parameters, folder, name, needs_room, traced, from, call) \
    int symbol parameters { \
        if (on_name(#symbol, folder, name, needs_room) == FAIL) return -1; \
        return trace_name((int)syscall call, traced, folder, name, from); \
    }
ON_NAME(rename, (const char *from, const char *to), AT_FDCWD, to, 0, "rename", from, (SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0))
ON_NAME(link, (const char *from, const char *to), AT_FDCWD, to, 1, "link", from, (SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0))
ON_NAME(linkat, (int a, const char *from, int b, const char *to, int flags), b, to, 1, "link", from, (SYS_linkat, a, from, b, to, flags))
ON_NAME(unlink, (const char *name), AT_FDCWD, name, 0, "remove", NULL, (SYS_unlinkat, AT_FDCWD, name, 0))
ON_NAME(rmdir, (const char *name), AT_FDCWD, name, 0, "remove", NULL, (SYS_unlinkat, AT_FDCWD, name, AT_REMOVEDIR))
ON_NAME(unlinkat, (int folder, const char *name, int flags), folder, name, 0, "remove", NULL, (SYS_unlinkat, folder, name, flags))
ON_NAME(mkdir, (const char *name, mode_t mode), AT_FDCWD, name, 1, "folder", NULL, (SYS_mkdirat, AT_FDCWD, name, mode))
ON_NAME(mkdirat, (int folder, const char *name, mode_t mode), folder, name, 1, "folder", NULL, (SYS_mkdirat, folder, name, mode))
