/* Stands in for a file system that does not offer some calls: below the folder REFUSE_UNDER, those of REFUSE fail.

   REFUSE is "call=number call=number ...", the numbers being those of errno; calls are chmod, flock, fsync,
   fsync_folder, link and rename_over (of a file onto another). Loaded by LD_PRELOAD. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static int refused(const char *call, const char *path)
{
    const char *under = getenv("REFUSE_UNDER"), *calls = getenv("REFUSE");
    char whole[8192], from[4096], word[64];
    if (!under || !calls || !path)
        return 0;
    if (path[0] != '/' && getcwd(from, sizeof from)) {
        snprintf(whole, sizeof whole, "%s/%s", from, path);
        path = whole;
    }
    snprintf(word, sizeof word, "%s=", call);
    const char *found = strstr(calls, word);
    if (!found || (found != calls && found[-1] != ' ') || strncmp(path, under, strlen(under)))
        return 0;
    errno = atoi(found + strlen(word));
    return 1;
}

static int refused_open(const char *call, int number)
{
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", number);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return refused(call, path);
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

int flock(int number, int how);
int flock(int number, int how)
{
    return refused_open("flock", number) ? -1 : NEXT(flock)(number, how);
}

int fsync(int number)
{
    struct stat facts;
    int is_folder = !fstat(number, &facts) && S_ISDIR(facts.st_mode);
    return refused_open(is_folder ? "fsync_folder" : "fsync", number) ? -1 : NEXT(fsync)(number);
}

int chmod(const char *path, mode_t mode)
{
    return refused("chmod", path) ? -1 : NEXT(chmod)(path, mode);
}

int fchmod(int number, mode_t mode)
{
    return refused_open("chmod", number) ? -1 : NEXT(fchmod)(number, mode);
}

int fchmodat(int folder, const char *path, mode_t mode, int flags)
{
    return refused("chmod", path) ? -1 : NEXT(fchmodat)(folder, path, mode, flags);
}

int link(const char *from, const char *to)
{
    return refused("link", to) ? -1 : NEXT(link)(from, to);
}

int linkat(int a, const char *from, int b, const char *to, int flags)
{
    return refused("link", to) ? -1 : NEXT(linkat)(a, from, b, to, flags);
}

static int is_over(const char *to)
{
    struct stat facts;
    return !lstat(to, &facts) && !S_ISDIR(facts.st_mode) && refused("rename_over", to);
}

int rename(const char *from, const char *to)
{
    return is_over(to) ? -1 : NEXT(rename)(from, to);
}

int renameat(int a, const char *from, int b, const char *to)
{
    return is_over(to) ? -1 : NEXT(renameat)(a, from, b, to);
}
