// An application outside the source tree, which includes and links only the installed SDK.
#include <iostream>

#include <lightwell/probe.hpp>

int main() {
  std::cout << "lightwell " << lightwell::version() << '\n';
  return 0;
}
