// liblightwell.so of a build without the light field.
#include "c/field_module.hpp"

namespace lightwell::c {

const Result<const FieldEntry*>& field_module() {
  static const auto* const none =
      new Result<const FieldEntry*>(Status(StatusCode::failed_precondition,
                                           "this liblightwell was built without the light field: build it with Ceres, "
                                           "and without field in LIGHTWELL_WITHOUT"));
  return *none;
}

}  // namespace lightwell::c
