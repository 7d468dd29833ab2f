// lightwell.h, conventions.h, cube_map.h, field.h, light_estimate.h, plane_appearance.h, plane_objects.h,
// probe_status.h and shadows.h are also valid in the oldest supported C++, with the same meaning.
#include <cstring>

#include <lightwell/conventions.h>
#include <lightwell/cube_map.h>
#include <lightwell/field.h>
#include <lightwell/light_estimate.h>
#include <lightwell/lightwell.h>
#include <lightwell/plane_appearance.h>
#include <lightwell/plane_objects.h>
#include <lightwell/probe_status.h>
#include <lightwell/shadows.h>

#include "check.h"

int main() {
  lw_lighting* light = NULL;
  CHECK(lw_lighting_create(&light) == LW_OK);
  lw_lighting_info info = lw_lighting_info();
  info.size = sizeof info;
  CHECK(lw_lighting_get_info(light, &info) == LW_OK && info.validity == LW_NONE);
  CHECK(std::strcmp(lw_validity_name(info.validity), "none") == 0);
  lw_light_estimate estimate = lw_light_estimate();
  estimate.size = sizeof estimate;
  CHECK(lw_lighting_estimate(light, NULL, &estimate) == LW_OK && estimate.available == LW_REQUEST_NONE);
  lw_lighting_release(light);
  lw_plane* plane = NULL;
  CHECK(lw_plane_create(&plane) == LW_OK);
  lw_plane_info about = lw_plane_info();
  about.size = sizeof about;
  CHECK(lw_plane_get_info(plane, &about) == LW_OK && about.validity == LW_NONE);
  lw_plane_release(plane);
  return checks_failed(6);
}
