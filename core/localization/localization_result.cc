#include "core/localization/localization_result.h"

namespace atlas {

std::string_view MapCoverName(MapCover cover) {
  switch (cover) {
    case MapCover::kNone:
      return "none";
    case MapCover::kCoarse:
      return "coarse";
    case MapCover::kFine:
      return "fine";
  }
  return "none";
}

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
