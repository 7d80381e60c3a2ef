// Of a list of figures.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace atlas::testing {

// The q-th of the values in order, q from 0 to 1; 0 of none.
inline double Quantile(std::vector<double> values, double q) {
  if (values.empty()) {
    return 0.0;
  }
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

}  // namespace atlas::testing
