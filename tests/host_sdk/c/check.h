/* Statements of a C program: CHECK(condition) tells file and line of what is not so; checks_failed() is what main
 * returns. */
#ifndef LIGHTWELL_TESTS_CHECK_H
#define LIGHTWELL_TESTS_CHECK_H

#include <stdio.h>

static int checks_made = 0;
static int checks_wrong = 0;

#define CHECK(condition)                                                      \
  do {                                                                        \
    ++checks_made;                                                            \
    if (!(condition)) {                                                       \
      ++checks_wrong;                                                         \
      fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
    }                                                                         \
  } while (0)

static int checks_failed(int at_least) {
  printf("%d checks, %d wrong\n", checks_made, checks_wrong);
  if (checks_made < at_least) {
    fprintf(stderr, "fewer than %d checks were made\n", at_least);
    return 1;
  }
  return checks_wrong == 0 ? 0 : 1;
}

#endif
