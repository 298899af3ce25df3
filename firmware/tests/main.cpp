// Runs all tests, or those whose name contains the argument.
#include <cstring>

#include "testing.h"

int main(int count, char** arguments) {
  int passed = 0;
  int failed = 0;
  for (const testing::Test& test : testing::tests()) {
    if (count > 1 && std::strstr(test.name, arguments[1]) == nullptr) continue;
    const int before = testing::failures();
    test.body();
    const bool good = testing::failures() == before;
    std::printf("%s %s\n", good ? "ok  " : "FAIL", test.name);
    std::fflush(stdout);
    ++(good ? passed : failed);
  }
  std::printf("%d passed, %d failed\n", passed, failed);
  return failed == 0 && passed > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
