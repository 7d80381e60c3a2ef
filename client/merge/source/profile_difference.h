// What two map profiles differ in, for people.
#pragma once

#include <string>

#include "core/geometry/map_profile.h"

namespace atlas {

// "cells of 0.2 m instead of 0.1 m, ...": what `one` has and what `other` has. Numbers that only
// say how keyframes are fused are told as such, together. Empty where both are equal.
std::string DifferenceOf(const MapProfile& one, const MapProfile& other);

}  // namespace atlas
