// Stable sorting of a handful of elements that are mostly in order already, without memory.
#pragma once

#include <algorithm>
#include <utility>

namespace atlas {

// As std::stable_sort.
template <typename Iterator, typename Less>
void SmallStableSort(Iterator begin, Iterator end, const Less& is_less) {
  constexpr auto kSmall = 64;
  if (end - begin > kSmall) {
    std::stable_sort(begin, end, is_less);
    return;
  }
  for (Iterator i = begin; i != end; ++i) {
    auto value = std::move(*i);
    Iterator place = i;
    for (; place != begin && is_less(value, *(place - 1)); --place) {
      *place = std::move(*(place - 1));
    }
    *place = std::move(value);
  }
}

}  // namespace atlas
