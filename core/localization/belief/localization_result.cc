#include "core/localization/belief/localization_result.h"

namespace atlas {

std::string_view LocalizationHealthName(LocalizationHealth health) {
  switch (health) {
    case LocalizationHealth::kGood:
      return "good";
    case LocalizationHealth::kWeak:
      return "weak";
    case LocalizationHealth::kLost:
      return "lost";
  }
  return "lost";
}

}  // namespace atlas
