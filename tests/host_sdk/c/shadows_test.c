/* Shadows through the C ABI: values, strides, defaults, errors. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include <lightwell/shadows.h>

#include "check.h"
#include "lamp.h"

enum { SIDE = 16, FLOATS = 3 * SIDE * SIDE };

/* A sheet of 10 x 10 cm, 10 cm above the middle of the plane; each vertex has a normal, too. */
static const float interleaved[4][6] = {{-0.05F, -0.05F, 0.1F, 0, 0, 1},
                                        {0.05F, -0.05F, 0.1F, 0, 0, 1},
                                        {0.05F, 0.05F, 0.1F, 0, 0, 1},
                                        {-0.05F, 0.05F, 0.1F, 0, 0, 1}};
static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};

/* A plane of 16 x 16 cm that faces +X, where the lamp is. */
static lw_shadow_receiver facing_the_lamp(void) {
  lw_shadow_receiver plane = {.size = sizeof plane, .columns = SIDE, .rows = SIDE, .width = 0.16, .height = 0.16};
  plane.orientation[1] = plane.orientation[3] = sqrt(0.5);
  return plane;
}

static lw_shadow_mesh sheet(void) {
  lw_shadow_mesh mesh = {.size = sizeof mesh, .positions = interleaved, .position_stride = sizeof interleaved[0]};
  mesh.position_count = 4;
  mesh.indices = indices;
  mesh.index_count = 6;
  return mesh;
}

static float at(const float* ratios, int column, int row) { return ratios[3 * (row * SIDE + column)]; }

static void a_sheet_hides_the_lamp(lw_shadow_caster* caster, const lw_lighting* light) {
  float ratios[FLOATS + 1], packed[FLOATS], tight[4][3];
  const lw_shadow_receiver plane = facing_the_lamp();
  lw_shadow_mesh mesh = sheet();
  lw_shadow_summary s = {.size = sizeof s};
  int i;
  ratios[FLOATS] = 7;
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, ratios, FLOATS, &s) == LW_OK);
  CHECK(ratios[FLOATS] == 7);
  CHECK(s.size == sizeof s && s.validity == LW_VALID && strcmp(s.reason, "") == 0 && s.no_light == 0 && s.lights == 1);
  CHECK(s.ignored_triangles == 0 && s.directions > 0);
  for (i = 0; i < FLOATS; ++i) CHECK(ratios[i] >= 0 && ratios[i] <= 1);
  /* A tenth of the light is residual, of which the sheet hides a quarter. */
  CHECK(at(ratios, 8, 8) < 0.12F && at(ratios, 0, 0) > 0.97F);
  /* Tightly packed and without a summary; the sheet moved by its pose. */
  for (i = 0; i < 4; ++i) memcpy(tight[i], interleaved[i], sizeof tight[i]);
  mesh.positions = tight;
  mesh.position_stride = 0;
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, packed, FLOATS, NULL) == LW_OK);
  CHECK(memcmp(packed, ratios, sizeof packed) == 0);
  mesh.position[0] = 0.06;
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, packed, FLOATS, NULL) == LW_OK);
  CHECK(at(packed, 2, 8) > 0.97F && at(packed, 15, 8) < 0.12F);
}

static void arguments_are_checked(lw_shadow_caster* caster, lw_lighting* light) {
  float ratios[FLOATS] = {5};
  const lw_shadow_receiver plane = facing_the_lamp();
  const lw_shadow_mesh mesh = sheet();
  const uint32_t beyond[3] = {0, 1, 4};
  lw_shadow_receiver bad_planes[3];
  lw_shadow_mesh bad_meshes[6];
  size_t i;
  lw_shadow_options options = {.size = sizeof options};
  lw_shadow_summary s = {.size = sizeof s};
  lw_shadow_caster* made = NULL;
  CHECK(lw_shadow_caster_cast(NULL, light, &plane, &mesh, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(s.validity == LW_INVALID_QUERY && strstr(lw_last_error(NULL), "lw_shadow_caster") != NULL);
  CHECK(lw_shadow_caster_cast((lw_shadow_caster*)(void*)light, light, &plane, &mesh, ratios, FLOATS, &s) ==
        LW_INVALID_ARGUMENT);
  CHECK(lw_shadow_caster_cast(caster, NULL, &plane, &mesh, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(lw_shadow_caster_cast(caster, light, NULL, &mesh, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(lw_shadow_caster_cast(caster, light, &plane, NULL, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, NULL, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, ratios, FLOATS - 1, &s) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "768") != NULL);
  s.size = 0;
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  s.size = sizeof s;
  for (i = 0; i < 3; ++i) bad_planes[i] = plane;
  bad_planes[0].size = 0;
  bad_planes[1].width = NAN;
  bad_planes[2].rows = -1;
  for (i = 0; i < 3; ++i)
    CHECK(lw_shadow_caster_cast(caster, light, &bad_planes[i], &mesh, ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  for (i = 0; i < 6; ++i) bad_meshes[i] = mesh;
  bad_meshes[0].position_stride = 8;
  bad_meshes[1].positions = NULL;
  bad_meshes[2].indices = NULL;
  bad_meshes[3].position_count = SIZE_MAX;
  bad_meshes[4].orientation[0] = INFINITY;
  bad_meshes[5].indices = beyond;
  bad_meshes[5].index_count = 3;
  for (i = 0; i < 6; ++i)
    CHECK(lw_shadow_caster_cast(caster, light, &plane, &bad_meshes[i], ratios, FLOATS, &s) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "index 4") != NULL && s.validity == LW_INVALID_QUERY);
  /* Refused calls wrote no ratio. */
  CHECK(ratios[0] == 5 && ratios[1] == 0);
  CHECK(lw_shadow_caster_create(NULL, NULL) == LW_INVALID_ARGUMENT);
  options.light_samples = 1025;
  CHECK(lw_shadow_caster_create(&options, &made) == LW_INVALID_ARGUMENT && made == NULL);
  options.light_samples = -1;
  CHECK(lw_shadow_caster_create(&options, &made) == LW_INVALID_ARGUMENT && made == NULL);
  lw_shadow_caster_release(NULL);
  lw_shadow_caster_release((lw_shadow_caster*)(void*)light);
}

static void without_light_or_object(lw_shadow_caster* caster, const lw_lighting* light) {
  static float ratios[3 * 256 * 256];
  const lw_shadow_mesh nothing = {.size = sizeof nothing}, mesh = sheet();
  lw_shadow_receiver plane = {.size = sizeof plane, .width = 1, .height = 1};
  lw_shadow_summary s = {.size = sizeof s};
  lw_lighting* none = NULL;
  size_t i;
  CHECK(lw_lighting_create(&none) == LW_OK);
  /* Zeros in the receiver: 256 texels along each side, the identity. The lamp at +X is on this plane's horizon. */
  CHECK(lw_shadow_caster_cast(caster, none, &plane, &mesh, ratios, sizeof ratios / sizeof *ratios, &s) == LW_OK);
  CHECK(s.validity == LW_NONE && s.no_light == 1 && strlen(s.reason) > 0);
  for (i = 0; i < sizeof ratios / sizeof *ratios; ++i)
    if (ratios[i] != 1) break;
  CHECK(i == sizeof ratios / sizeof *ratios);
  plane = facing_the_lamp();
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &nothing, ratios, FLOATS, &s) == LW_OK);
  CHECK(s.validity == LW_VALID && s.no_light == 0 && ratios[0] == 1 && ratios[FLOATS - 1] == 1);
  lw_lighting_release(none);
}

/* Light with harmonics and 13 lights, of a probe. */
static void light_of_a_recording(lw_shadow_caster* caster, const char* recording) {
  float ratios[FLOATS], lowest = 1, highest = 0;
  lw_shadow_receiver plane = {.size = sizeof plane, .columns = SIDE, .rows = SIDE, .width = 0.32, .height = 0.32};
  const lw_shadow_mesh mesh = sheet();
  int i;
  lw_shadow_summary s = {.size = sizeof s};
  lw_lighting* light = NULL;
  lw_probe* probe;
  CHECK(lw_lighting_create(&light) == LW_OK);
  probe = played(recording, light);
  /* It faces +Y. */
  plane.orientation[0] = -sqrt(0.5);
  plane.orientation[3] = sqrt(0.5);
  CHECK(lw_shadow_caster_cast(caster, light, &plane, &mesh, ratios, FLOATS, &s) == LW_OK);
  CHECK(s.lights > 0 && s.directions >= s.lights + 8 && s.no_light == 0);
  for (i = 0; i < FLOATS; ++i) {
    if (!(ratios[i] >= lowest)) lowest = ratios[i];
    if (!(ratios[i] <= highest)) highest = ratios[i];
  }
  CHECK(lowest > 0 && lowest < 0.9F && highest > lowest + 0.1F && highest <= 1);
  lw_lighting_release(light);
  lw_probe_close(probe);
}

int main(int argc, char** argv) {
  lw_shadow_options options = {.size = sizeof options};
  lw_shadow_caster *caster = NULL, *small = NULL;
  lw_lighting* light;
  if (argc != 3) return 2;
  light = lamp(argv[1]);
  CHECK(lw_shadow_caster_create(NULL, &caster) == LW_OK && caster != NULL);
  options.residual_directions = 8;
  CHECK(lw_shadow_caster_create(&options, &small) == LW_OK && small != NULL);
  a_sheet_hides_the_lamp(caster, light);
  a_sheet_hides_the_lamp(small, light);
  arguments_are_checked(caster, light);
  without_light_or_object(caster, light);
  light_of_a_recording(small, argv[2]);
  lw_shadow_caster_release(caster);
  lw_shadow_caster_release(small);
  lw_lighting_release(light);
  return checks_failed(50);
}
