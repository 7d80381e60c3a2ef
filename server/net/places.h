// A number of places that are taken and given back: connections, requests that wait. Thread-safe.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace atlas {

class Places {
 public:
  // Gives itself back when it is destroyed; may outlive the Places.
  using Place = std::shared_ptr<const void>;

  explicit Places(std::size_t max_places) : max_places_(max_places) {}

  // Null when all are taken.
  Place Take() {
    if (taken_->fetch_add(1) >= max_places_.load()) {
      taken_->fetch_sub(1);
      return nullptr;
    }
    return {this, [taken = taken_](const void*) {
              taken->fetch_sub(1);
            }};
  }
  // Given back together.
  static Place Both(Place first, Place second) {
    return std::make_shared<std::pair<Place, Place>>(std::move(first), std::move(second));
  }
  std::size_t max_places() const { return max_places_.load(); }
  // Nobody loses a place that was taken.
  void set_max_places(std::size_t max_places) { max_places_.store(max_places); }
  std::size_t taken() const { return taken_->load(); }

 private:
  std::atomic<std::size_t> max_places_;
  std::shared_ptr<std::atomic<std::size_t>> taken_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace atlas
