// An application outside the source tree: what it can include and link is what was installed.
#include <iostream>

#include <lightwell/probe.hpp>

int main() {
  std::cout << "lightwell " << lightwell::version() << '\n';
  return 0;
}
