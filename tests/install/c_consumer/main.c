/* An application in C outside the source tree. */
#include <stdio.h>

#include <lightwell/lightwell.h>

int main(void) {
  lw_lighting* light = NULL;
  lw_lighting_info info = {.size = sizeof info};
  if (lw_lighting_create(&light) != LW_OK || lw_lighting_get_info(light, &info) != LW_OK) return 1;
  if (lw_abi_version() != LW_ABI_VERSION || info.validity != LW_NONE) return 1;
  lw_lighting_release(light);
  printf("lightwell %s\n", lw_version());
  return 0;
}
