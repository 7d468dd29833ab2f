#include <array>

#include "camera/conformance/checks.hpp"

namespace lightwell::conformance {

std::span<const Check> all_checks() {
  static constexpr std::array kChecks = {
      Check{"sequence", check_sequence},
      Check{"times", check_times},
      Check{"views", check_views},
      Check{"exposures", check_exposures},
      Check{"one_thread", check_one_thread},
      Check{"no_push_after_stop", check_no_push_after_stop},
      Check{"restart", check_restart},
      Check{"states", check_states},
      Check{"lifecycle_without_frames", check_lifecycle_without_frames},
      Check{"held_across_stop", check_held_across_stop},
      Check{"retaining_sink", check_retaining_sink},
      Check{"release_on_other_thread", check_release_on_other_thread},
      Check{"slow_sink", check_slow_sink},
      Check{"end", check_end},
      Check{"loss", check_loss},
  };
  return kChecks;
}

}  // namespace lightwell::conformance
