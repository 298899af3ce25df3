#include "testing.h"

int main() {
  int passed = 0;
  int failed = 0;
  for (const testing::Test& test : testing::tests()) {
    const int before = testing::failures();
    test.body();
    const bool good = testing::failures() == before;
    std::printf("%s %s\n", good ? "ok  " : "FAIL", test.name);
    ++(good ? passed : failed);
  }
  std::printf("%d passed, %d failed\n", passed, failed);
  return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
