// Plays the kernel's i2c-dev in front of the simulated arm. Preloaded into a process, it answers
// open, ioctl and close of the one I2C device that it pretends to have; each transaction goes
// through a Unix socket to arm_server.py and there to the compiled firmware.
//
// Environment:
//   BIOSCARA_SHIM_DEVICE  the device that exists, for example /dev/i2c-1
//   BIOSCARA_SHIM_SOCKET  the socket of the arm
//   BIOSCARA_SHIM_RULES   pi4: a read must be the last message (i2c-bcm2835)
//                         pi5: one address per ioctl, no empty message (i2c-designware)
//                         otherwise: what i2c-dev itself allows
// What a test may ask and order is at the end of this file.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/un.h>
#include <unistd.h>

#define LENGTH_MAX 8192  // drivers/i2c/i2c-dev.c
#define FD_MAX 1024

static unsigned char is_bus[FD_MAX];
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;

static int fail_error, fail_count, open_error;
static unsigned long functions = I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL;
static long opens, transfers, timeout = -1, retries = -1, most_messages;

static int real_open(const char *path, int flags, mode_t mode) {
  static int (*real)(const char *, int, ...);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "open64");
  return real(path, flags, mode);
}

static int real_close(int fd) {
  static int (*real)(int);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "close");
  return real(fd);
}

static int real_ioctl(int fd, unsigned long request, void *argument) {
  static int (*real)(int, unsigned long, ...);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "ioctl");
  return real(fd, request, argument);
}

static int rules_are(const char *name) {
  const char *rules = getenv("BIOSCARA_SHIM_RULES");
  return rules && strcmp(rules, name) == 0;
}

static int pretended(const char *path) {
  const char *device = getenv("BIOSCARA_SHIM_DEVICE");
  return device && strcmp(path, device) == 0;
}

// -- the simulated arm -------------------------------------------------------------------------

static int connect_arm(void) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  const char *path = getenv("BIOSCARA_SHIM_SOCKET");
  if (!path || strlen(path) >= sizeof address.sun_path) return -ENODEV;
  strcpy(address.sun_path, path);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -errno;
  if (connect(fd, (struct sockaddr *)&address, sizeof address) != 0 || fd >= FD_MAX) {
    real_close(fd);
    return -ENODEV;
  }
  return fd;
}

static int send_all(int fd, const void *data, size_t size) {
  const char *next = data;
  while (size > 0) {
    const ssize_t sent = send(fd, next, size, MSG_NOSIGNAL);
    if (sent <= 0) return ENODEV;
    next += sent;
    size -= (size_t)sent;
  }
  return 0;
}

static int receive_all(int fd, void *data, size_t size) {
  char *next = data;
  while (size > 0) {
    const ssize_t received = recv(fd, next, size, 0);
    if (received <= 0) return ENODEV;
    next += received;
    size -= (size_t)received;
  }
  return 0;
}

// One write and read of one address; returns 0 or the errno that the kernel would set. The frames
// are those of arm_server.py.
static int exchange(int fd, uint16_t address, const struct i2c_msg *write,
                    const struct i2c_msg *read) {
  const uint16_t head[3] = {address, write ? write->len : 0, read ? read->len : 0};
  uint8_t error = ENODEV;
  if (send_all(fd, head, sizeof head)) return ENODEV;
  if (write && send_all(fd, write->buf, write->len)) return ENODEV;
  if (receive_all(fd, &error, sizeof error)) return ENODEV;
  return error || !read ? error : receive_all(fd, read->buf, read->len);
}

// -- what the kernel does ----------------------------------------------------------------------

static int check_rules(const struct i2c_msg *messages, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    if (messages[i].len > LENGTH_MAX) return EINVAL;
    if (rules_are("pi4") && i + 1 < count && (messages[i].flags & I2C_M_RD)) return EOPNOTSUPP;
    if (rules_are("pi5") && messages[i].len == 0) return EOPNOTSUPP;
    if (rules_are("pi5") && messages[i].addr != messages[0].addr) return EINVAL;
  }
  return 0;
}

static int transfer(int fd, struct i2c_rdwr_ioctl_data *request) {
  if (!request || !request->msgs || request->nmsgs == 0) return EINVAL;
  if (request->nmsgs > I2C_RDWR_IOCTL_MAX_MSGS) return EINVAL;
  if ((long)request->nmsgs > most_messages) most_messages = request->nmsgs;
  int error = check_rules(request->msgs, request->nmsgs);
  for (uint32_t i = 0; !error && i < request->nmsgs; ++i) {
    const struct i2c_msg *first = &request->msgs[i];
    const struct i2c_msg *second = i + 1 < request->nmsgs ? first + 1 : NULL;
    if (first->flags & I2C_M_RD) {
      error = exchange(fd, first->addr, NULL, first);
    } else if (second && (second->flags & I2C_M_RD) && second->addr == first->addr) {
      error = exchange(fd, first->addr, first, second);
      ++i;
    } else {
      error = exchange(fd, first->addr, first, NULL);
    }
  }
  return error;
}

static int bus_ioctl(int fd, unsigned long request, void *argument) {
  int error = 0, result = 0;
  switch (request) {
    case I2C_RDWR:
      ++transfers;
      if (fail_count > 0) {
        --fail_count;
        error = fail_error;
      } else {
        error = transfer(fd, argument);
        result = error ? 0 : (int)((struct i2c_rdwr_ioctl_data *)argument)->nmsgs;
      }
      break;
    case I2C_FUNCS:
      *(unsigned long *)argument = functions;
      break;
    case I2C_TIMEOUT:
      timeout = (long)argument;
      break;
    case I2C_RETRIES:
      retries = (long)argument;
      break;
    default:
      error = ENOTTY;
  }
  if (!error) return result;
  errno = error;
  return -1;
}

// -- interposed --------------------------------------------------------------------------------

static int bus_open(void) {
  ++opens;
  const int fd = open_error ? -open_error : connect_arm();
  if (fd < 0) {
    errno = -fd;
    return -1;
  }
  is_bus[fd] = 1;
  return fd;
}

static int shim_open(const char *path, int flags, mode_t mode) {
  if (!pretended(path)) return real_open(path, flags, mode);
  pthread_mutex_lock(&mutex);
  const int fd = bus_open();
  pthread_mutex_unlock(&mutex);
  return fd;
}

static mode_t mode_of(int flags, va_list arguments) {
  return flags & (O_CREAT | __O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
}

int open(const char *path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return shim_open(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return shim_open(path, flags, mode);
}

int ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void *argument = va_arg(arguments, void *);
  va_end(arguments);
  if (fd < 0 || fd >= FD_MAX || !is_bus[fd]) return real_ioctl(fd, request, argument);
  pthread_mutex_lock(&mutex);
  const int result = bus_ioctl(fd, request, argument);
  pthread_mutex_unlock(&mutex);
  return result;
}

int close(int fd) {
  if (fd >= 0 && fd < FD_MAX) is_bus[fd] = 0;
  return real_close(fd);
}

// -- for tests ---------------------------------------------------------------------------------

// The next `count` transfers fail with this errno and reach nobody.
void shim_fail(int error, int count) {
  fail_error = error;
  fail_count = count;
}

// Opening the device fails with this errno until set to 0.
void shim_fail_open(int error) { open_error = error; }

// The adapter's functionality mask.
void shim_functions(unsigned long mask) { functions = mask; }

long shim_opens(void) { return opens; }
long shim_transfers(void) { return transfers; }
long shim_timeout(void) { return timeout; }
long shim_retries(void) { return retries; }
long shim_most_messages(void) { return most_messages; }
