/*
 * The limit: what a Modbus TCP read of 16 registers costs when nothing but the bytes is exchanged, 12 out and 41 back,
 * one epoll_wait for whatever is ready, one read and one write an exchange. It checks nothing but lengths.
 *
 *   bare server                                    prints the port, then serves until killed
 *   bare client PORT CONNECTIONS WARM_MS RUN_MS    prints "go", then "end EXCHANGES"
 */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

enum { REQUEST = 12, ANSWER = 41, EVENTS = 1024 };

static unsigned char request[REQUEST] = {0, 1, 0, 0, 0, 6, 1, 3, 0x28, 0x00, 0, 16};
static unsigned char answer[ANSWER] = {0, 1, 0, 0, 0, 35, 1, 3, 32};

static void fail(const char *what) {
    perror(what);
    exit(1);
}

static void watch(int epoll, int fd, unsigned events) {
    struct epoll_event event = {.events = events, .data.fd = fd};
    if (epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) < 0) fail("epoll_ctl");
}

static void prepare(int fd) {
    int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    fcntl(fd, F_SETFL, O_NONBLOCK);
}

static void serve(void) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    if (bind(listener, (struct sockaddr *)&address, size) < 0 || listen(listener, 1024) < 0) fail("listen");
    getsockname(listener, (struct sockaddr *)&address, &size);
    printf("%d\n", ntohs(address.sin_port));
    fflush(stdout);

    int epoll = epoll_create1(0);
    watch(epoll, listener, EPOLLIN);
    struct epoll_event events[EVENTS];
    unsigned char buffer[512];
    for (;;) {
        int ready = epoll_wait(epoll, events, EVENTS, -1);
        for (int i = 0; i < ready; i++) {
            int fd = events[i].data.fd;
            if (fd == listener) {
                int accepted = accept4(listener, NULL, NULL, SOCK_NONBLOCK);
                if (accepted < 0) continue;
                prepare(accepted);
                watch(epoll, accepted, EPOLLIN | EPOLLET);
                continue;
            }
            ssize_t count = read(fd, buffer, sizeof buffer);
            if (count <= 0) {
                close(fd);
            } else if (count == REQUEST) {
                memcpy(answer, buffer, 2);
                answer[10] = buffer[1]; /* something that changes */
                if (write(fd, answer, ANSWER) != ANSWER) fail("write");
            }
        }
    }
}

static long run(int epoll, int timer, int milliseconds) {
    struct itimerspec at = {.it_value = {milliseconds / 1000, milliseconds % 1000 * 1000000L}};
    timerfd_settime(timer, 0, &at, NULL);
    struct epoll_event events[EVENTS];
    unsigned char buffer[512];
    unsigned short transaction = 0;
    long exchanges = 0;
    for (;;) {
        int ready = epoll_wait(epoll, events, EVENTS, -1);
        int over = 0;
        for (int i = 0; i < ready; i++) {
            int fd = events[i].data.fd;
            if (fd == timer) {
                over = read(timer, buffer, 8) == 8;
                continue;
            }
            if (read(fd, buffer, sizeof buffer) != ANSWER) fail("read");
            exchanges++;
            transaction++;
            request[0] = transaction >> 8;
            request[1] = transaction & 0xFF;
            if (write(fd, request, REQUEST) != REQUEST) fail("write");
        }
        /* Not before the batch is done: EPOLLET tells of each answer once. */
        if (over) return exchanges;
    }
}

static void ask(int port, int connections, int warm, int milliseconds) {
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int epoll = epoll_create1(0);
    int timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
    watch(epoll, timer, EPOLLIN);
    for (int i = 0; i < connections; i++) {
        int fd = socket(AF_INET, SOCK_STREAM, 0);
        if (connect(fd, (struct sockaddr *)&address, sizeof address) < 0) fail("connect");
        prepare(fd);
        watch(epoll, fd, EPOLLIN | EPOLLET);
        if (write(fd, request, REQUEST) != REQUEST) fail("write");
    }
    run(epoll, timer, warm);
    printf("go\n");
    fflush(stdout);
    long exchanges = run(epoll, timer, milliseconds);
    printf("end %ld\n", exchanges);
    fflush(stdout);
}

int main(int argc, char **argv) {
    if (argc == 2 && !strcmp(argv[1], "server")) serve();
    if (argc == 6 && !strcmp(argv[1], "client")) {
        ask(atoi(argv[2]), atoi(argv[3]), atoi(argv[4]), atoi(argv[5]));
        return 0;
    }
    fprintf(stderr, "usage: bare server | bare client PORT CONNECTIONS WARM_MS RUN_MS\n");
    return 2;
}
