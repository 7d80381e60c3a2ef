#include "core/fusion/survey/spare_segments.h"

#include <utility>

namespace atlas {
namespace {

constexpr std::size_t kAlwaysKept = 2;

}  // namespace

std::size_t SpareSegments::bytes() const {
  std::size_t bytes = 0;
  for (const Batch& batch : batches_) {
    bytes +=
        sizeof(batch) + batch.segments.bytes() + batch.stretches.capacity() * sizeof(std::uint32_t);
  }
  return bytes;
}

void SpareSegments::Push(SettledSegments batch) {
  std::vector<std::uint32_t> stretches = batch.FindStretches();
  batch.Pack();
  batches_.push_back({std::move(batch), std::move(stretches)});
}

std::vector<std::uint32_t> SpareSegments::DropOldest(std::size_t max_bytes) {
  std::vector<std::uint32_t> gone;
  while (batches_.size() > kAlwaysKept && bytes() > max_bytes) {
    const std::vector<std::uint32_t>& stretches = batches_.front().stretches;
    gone.insert(gone.end(), stretches.begin(), stretches.end());
    batches_.erase(batches_.begin());
  }
  return gone;
}

std::vector<SettledSegments> SpareSegments::TakeAll() {
  std::vector<SettledSegments> all;
  for (Batch& batch : batches_) {
    batch.segments.Unpack();
    all.push_back(std::move(batch.segments));
  }
  batches_.clear();
  return all;
}

}  // namespace atlas
