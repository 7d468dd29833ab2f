// lightwell.h, conventions.h and shadows.h are also valid in the oldest supported C++, with the same meaning.
#include <cstring>

#include <lightwell/conventions.h>
#include <lightwell/lightwell.h>
#include <lightwell/shadows.h>

#include "check.h"

int main() {
  lw_lighting* light = NULL;
  CHECK(lw_lighting_create(&light) == LW_OK);
  lw_lighting_info info = lw_lighting_info();
  info.size = sizeof info;
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.validity == LW_NONE);
  CHECK(std::strcmp(lw_validity_name(info.validity), "none") == 0);
  lw_lighting_release(light);
  return checks_failed(3);
}
