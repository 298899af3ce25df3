// A minimal test framework: a name, a check, a count.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <vector>

namespace testing {

struct Test {
  const char* name;
  void (*body)();
};

inline std::vector<Test>& tests() {
  static std::vector<Test> all;
  return all;
}

struct Registration {
  Registration(const char* name, void (*body)()) { tests().push_back({name, body}); }
};

inline int& failures() {
  static int count = 0;
  return count;
}

}  // namespace testing

#define TEST(name)                                              \
  static void name();                                           \
  static const testing::Registration name##_registered(#name, name); \
  static void name()

#define CHECK(condition)                                                           \
  do {                                                                             \
    if (!(condition)) {                                                            \
      ++testing::failures();                                                       \
      std::printf("  %s:%d: not so: %s\n", __FILE__, __LINE__, #condition);        \
    }                                                                              \
  } while (false)
