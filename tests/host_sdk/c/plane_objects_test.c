/* Reflections of objects in a plane and the light of a plane through the C ABI, on the golden message of plane_test.c:
 * a plane of 0.2 m, alpha 0.125, f0 0.0625, D about (0.5, 0.4, 0.3) in the middle. */
#include <math.h>
#include <string.h>

#include <lightwell/plane_objects.h>

#include "check.h"
#include "lamp.h"

enum { SIDE = 16, TEXELS = SIDE * SIDE };

/* A sheet of 10 x 10 cm, 3 cm above the middle of the plane; each vertex has a normal, too. */
static const float interleaved[4][6] = {{-0.05F, -0.05F, 0.03F, 0, 0, 1},
                                        {0.05F, -0.05F, 0.03F, 0, 0, 1},
                                        {0.05F, 0.05F, 0.03F, 0, 0, 1},
                                        {-0.05F, 0.05F, 0.03F, 0, 0, 1}};
static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
static const float radiance[4][3] = {{1, 2, 4}, {1, 2, 4}, {1, 2, 4}, {1, 2, 4}};
static const double eye[3] = {0, -0.3, 0.3};

static lw_plane* received(const char* path) {
  static unsigned char message[65536];
  size_t n = 0;
  FILE* file = fopen(path, "rb");
  lw_plane_reader* reader = NULL;
  lw_plane* plane = NULL;
  CHECK(file != NULL);
  if (file != NULL) {
    n = fread(message, 1, sizeof message, file);
    fclose(file);
  }
  CHECK(lw_plane_reader_create(&reader) == LW_OK && lw_plane_create(&plane) == LW_OK);
  CHECK(lw_plane_reader_take(reader, message, n, 1000) == LW_OK);
  CHECK(lw_plane_reader_snapshot(reader, 1000, plane) == LW_OK);
  lw_plane_reader_release(reader);
  return plane;
}

static lw_plane_grid grid(void) {
  lw_plane_grid out = {.size = sizeof out, .columns = SIDE, .rows = SIDE, .width = 0.16, .height = 0.16};
  return out;
}

static lw_shadow_mesh sheet(void) {
  lw_shadow_mesh mesh = {.size = sizeof mesh, .positions = interleaved, .position_stride = sizeof interleaved[0]};
  mesh.position_count = 4;
  mesh.indices = indices;
  mesh.index_count = 6;
  return mesh;
}

static lw_radiant_mesh radiant(const lw_shadow_mesh* mesh) {
  lw_radiant_mesh out = {.size = sizeof out, .mesh = mesh, .radiance = &radiance[0][0], .radiance_count = 4};
  return out;
}

static void the_plane_reflects_the_sheet(lw_plane_reflector* reflector, const lw_plane* plane) {
  float reflected[3 * TEXELS + 1], hidden[TEXELS + 1], again[3 * TEXELS];
  const lw_plane_grid to = grid();
  const lw_shadow_mesh mesh = sheet();
  lw_radiant_mesh object = radiant(&mesh);
  lw_plane_reflection about = {.size = sizeof about};
  int i, middle = 9 * SIDE + 8;
  reflected[3 * TEXELS] = hidden[TEXELS] = 7;
  CHECK(lw_plane_reflector_render(reflector, plane, &to, &object, eye, reflected, 3 * TEXELS, hidden, TEXELS, &about) ==
        LW_OK);
  CHECK(reflected[3 * TEXELS] == 7 && hidden[TEXELS] == 7);
  CHECK(about.size == sizeof about && about.validity == LW_VALID && about.f0_assumed == 0);
  CHECK(about.ignored_triangles == 0 && about.texels > 50 && about.texels <= TEXELS);
  for (i = 0; i < TEXELS; ++i) CHECK(hidden[i] >= 0 && hidden[i] <= 1);
  /* In the mirror image the sheet fills most of the lobe; the albedo is near f0, and the channels are as 1, 2, 4. */
  CHECK(hidden[middle] > 0.8F && hidden[0] < 0.2F);
  CHECK(reflected[3 * middle] > 0.8F * 0.0625F && reflected[3 * middle] < 2 * 0.0625F);
  CHECK(fabsf(reflected[3 * middle + 2] - 4 * reflected[3 * middle]) < 1e-5F);
  /* The same by triangle, without a summary. */
  object.radiance_per = LW_RADIANCE_PER_TRIANGLE;
  object.radiance_count = 2;
  CHECK(lw_plane_reflector_render(reflector, plane, &to, &object, eye, again, 3 * TEXELS, hidden, TEXELS, NULL) ==
        LW_OK);
  for (i = 0; i < 3 * TEXELS; ++i) CHECK(fabsf(again[i] - reflected[i]) < 1e-6F);
}

static void reflections_without_gloss_eye_or_object(lw_plane_reflector* reflector, const lw_plane* plane) {
  static float reflected[3 * 256 * 256], hidden[256 * 256];
  lw_plane_grid to = {.size = sizeof to, .width = 0.2, .height = 0.2};
  const lw_shadow_mesh mesh = sheet(), nothing = {.size = sizeof nothing};
  const lw_radiant_mesh object = radiant(&mesh), empty = {.size = sizeof empty, .mesh = &nothing};
  const double behind[3] = {0, 0, -0.1};
  lw_plane_reflection about = {.size = sizeof about};
  lw_plane* none = NULL;
  hidden[0] = 5;
  CHECK(lw_plane_create(&none) == LW_OK);
  /* Zeros in the grid: 256 texels along each side. */
  CHECK(lw_plane_reflector_render(reflector, none, &to, &object, eye, reflected, 3 * 256 * 256, hidden, 256 * 256,
                                  &about) == LW_OK);
  CHECK(about.validity == LW_NONE && hidden[0] == 0);
  to = grid();
  hidden[0] = 5;
  CHECK(lw_plane_reflector_render(reflector, plane, &to, &object, behind, reflected, 3 * TEXELS, hidden, TEXELS,
                                  &about) == LW_OK);
  CHECK(about.validity == LW_INVALID_QUERY && hidden[0] == 0);
  hidden[0] = 5;
  CHECK(lw_plane_reflector_render(reflector, plane, &to, &empty, eye, reflected, 3 * TEXELS, hidden, TEXELS, &about) ==
        LW_OK);
  CHECK(about.validity == LW_VALID && about.texels == 0 && hidden[0] == 0);
  lw_plane_release(none);
}

static void arguments_of_reflections_are_checked(lw_plane_reflector* reflector, const lw_plane* plane) {
  float reflected[3 * TEXELS] = {5}, hidden[TEXELS] = {5};
  const lw_plane_grid to = grid();
  const lw_shadow_mesh mesh = sheet();
  const lw_radiant_mesh object = radiant(&mesh);
  lw_plane_grid bad_grids[4];
  lw_radiant_mesh bad_objects[5];
  lw_shadow_mesh bad_mesh = sheet();
  lw_reflection_options options = {.size = sizeof options};
  lw_plane_reflection about = {.size = sizeof about};
  lw_plane_reflector* made = NULL;
  size_t i;
#define RENDER(reflector, plane, grid, object, eye, room, room_hidden) \
  lw_plane_reflector_render(reflector, plane, grid, object, eye, reflected, room, hidden, room_hidden, &about)
  CHECK(RENDER(NULL, plane, &to, &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(about.validity == LW_INVALID_QUERY && strstr(lw_last_error(NULL), "lw_plane_reflector") != NULL);
  CHECK(RENDER((lw_plane_reflector*)(void*)plane, plane, &to, &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(RENDER(reflector, NULL, &to, &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(RENDER(reflector, plane, NULL, &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(RENDER(reflector, plane, &to, NULL, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(RENDER(reflector, plane, &to, &object, NULL, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(RENDER(reflector, plane, &to, &object, eye, 3 * TEXELS - 1, TEXELS) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "768") != NULL);
  CHECK(RENDER(reflector, plane, &to, &object, eye, 3 * TEXELS, TEXELS - 1) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "256") != NULL);
  about.size = 0;
  CHECK(RENDER(reflector, plane, &to, &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  about.size = sizeof about;
  for (i = 0; i < 4; ++i) bad_grids[i] = to;
  bad_grids[0].size = 0;
  bad_grids[1].width = NAN;
  bad_grids[2].rows = -1;
  bad_grids[3].centre[1] = INFINITY;
  for (i = 0; i < 4; ++i)
    CHECK(RENDER(reflector, plane, &bad_grids[i], &object, eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
  for (i = 0; i < 5; ++i) bad_objects[i] = object;
  bad_objects[0].radiance_per = 2;
  bad_objects[1].radiance = NULL;
  bad_objects[2].radiance_count = 3;
  bad_objects[3].mesh = NULL;
  bad_mesh.position_stride = 8;
  bad_objects[4].mesh = &bad_mesh;
  for (i = 0; i < 5; ++i)
    CHECK(RENDER(reflector, plane, &to, &bad_objects[i], eye, 3 * TEXELS, TEXELS) == LW_INVALID_ARGUMENT);
#undef RENDER
  /* Refused calls wrote nothing. */
  CHECK(reflected[0] == 5 && reflected[1] == 0 && hidden[0] == 5 && hidden[1] == 0);
  CHECK(lw_plane_reflector_create(NULL, NULL) == LW_INVALID_ARGUMENT);
  options.cell = 17;
  CHECK(lw_plane_reflector_create(&options, &made) == LW_INVALID_ARGUMENT && made == NULL);
  options.cell = 0;
  options.tolerance = NAN;
  CHECK(lw_plane_reflector_create(&options, &made) == LW_INVALID_ARGUMENT && made == NULL);
  lw_plane_reflector_release(NULL);
  lw_plane_reflector_release((lw_plane_reflector*)(void*)plane);
}

static void the_plane_reflects_light(lw_plane_light* light, const lw_plane* plane, const lw_lighting* lamp_at_plus_x,
                                     const lw_lighting* recorded) {
  const double at[3] = {0, 0, 0.01}, down[3] = {0, 0, -1}, below[3] = {0, 0, -0.01}, nan[3] = {0, 0, NAN};
  lw_plane_light_answer diffuse = {.size = sizeof diffuse}, all = diffuse, whole = diffuse, bad = diffuse;
  CHECK(lw_plane_light_irradiance(light, at, down, LW_PLANE_ALL, &all) == LW_OK);
  CHECK(all.validity == LW_NONE && all.source == LW_PLANE_LIGHT_NONE && all.value[0] == 0);
  CHECK(lw_plane_light_irradiance_in(light, at, down, lamp_at_plus_x, &whole) == LW_OK);
  CHECK(whole.validity == LW_VALID && whole.source == LW_PLANE_LIGHT_DESCRIPTOR);
  CHECK(lw_plane_light_update(light, plane) == LW_OK);
  CHECK(lw_plane_light_irradiance(light, at, down, LW_PLANE_DIFFUSE, &diffuse) == LW_OK);
  CHECK(diffuse.size == sizeof diffuse && diffuse.validity == LW_VALID && diffuse.source == LW_PLANE_LIGHT_TEXTURE);
  /* A tenth of the half side above the middle, nearly pi D: the form factor is 0.99. */
  CHECK(fabs(diffuse.value[0] - 0.99 * 3.14159 * 0.5) < 0.02 && fabs(diffuse.value[1] - 0.99 * 3.14159 * 0.4) < 0.02);
  CHECK(lw_plane_light_irradiance(light, at, down, LW_PLANE_ALL, &all) == LW_OK &&
        all.value[0] > diffuse.value[0] + 0.5F);
  CHECK(lw_plane_light_irradiance_in(light, at, down, lamp_at_plus_x, &whole) == LW_OK);
  CHECK(whole.source == LW_PLANE_LIGHT_TEXTURE && whole.value[0] >= all.value[0] - 1e-4F);
  /* From above comes the light of the lighting alone. */
  {
    const float up[3] = {0, 0, 1};
    const double upwards[3] = {0, 0, 1};
    lw_answer e = {.size = sizeof e};
    CHECK(lw_lighting_irradiance(recorded, up, &e) == LW_OK && e.value[1] > 0);
    CHECK(lw_plane_light_irradiance_in(light, at, upwards, recorded, &whole) == LW_OK);
    CHECK(fabsf(whole.value[1] - e.value[1]) <= 1e-5F * e.value[1]);
  }
  CHECK(lw_plane_light_irradiance(light, below, down, LW_PLANE_ALL, &bad) == LW_OK);
  CHECK(bad.validity == LW_INVALID_QUERY && bad.value[0] == 0);
  CHECK(lw_plane_light_irradiance(light, at, nan, LW_PLANE_ALL, &bad) == LW_OK && bad.validity == LW_INVALID_QUERY);
  /* Arguments. */
  bad.value[0] = 5;
  CHECK(lw_plane_light_irradiance(NULL, at, down, LW_PLANE_ALL, &bad) == LW_INVALID_ARGUMENT);
  CHECK(bad.validity == LW_INVALID_QUERY && bad.value[0] == 0);
  CHECK(lw_plane_light_irradiance(light, NULL, down, LW_PLANE_ALL, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_irradiance(light, at, NULL, LW_PLANE_ALL, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_irradiance(light, at, down, 3, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_irradiance(light, at, down, LW_PLANE_ALL, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_irradiance_in(light, at, down, NULL, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_update(light, NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_update((lw_plane_light*)(void*)plane, plane) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_light_create(NULL) == LW_INVALID_ARGUMENT);
  lw_plane_light_release(NULL);
  lw_plane_light_release((lw_plane_light*)(void*)plane);
}

int main(int argc, char** argv) {
  lw_plane_reflector* reflector = NULL;
  lw_plane_light* light = NULL;
  lw_lighting *at_plus_x, *recorded = NULL;
  lw_probe* probe;
  lw_plane* plane;
  if (argc != 4) return 2;
  plane = received(argv[1]);
  at_plus_x = lamp(argv[2]);
  CHECK(lw_plane_reflector_create(NULL, &reflector) == LW_OK && reflector != NULL);
  CHECK(lw_plane_light_create(&light) == LW_OK && light != NULL);
  the_plane_reflects_the_sheet(reflector, plane);
  reflections_without_gloss_eye_or_object(reflector, plane);
  arguments_of_reflections_are_checked(reflector, plane);
  CHECK(lw_lighting_create(&recorded) == LW_OK);
  probe = played(argv[3], recorded);
  the_plane_reflects_light(light, plane, at_plus_x, recorded);
  lw_probe_close(probe);
  lw_lighting_release(recorded);
  lw_plane_reflector_release(reflector);
  lw_plane_light_release(light);
  lw_plane_release(plane);
  lw_lighting_release(at_plus_x);
  return checks_failed(100);
}
