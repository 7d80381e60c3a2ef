#include "server/service/fusion/survey_cache.h"

#include <utility>

namespace atlas {

std::optional<KeptSurveys> SurveyCache::Shelf::Take(std::uint64_t key) {
  const auto found = by_key.find(key);
  if (found == by_key.end()) {
    return std::nullopt;
  }
  const auto entry = found->second;
  bytes -= entry->bytes;
  KeptSurveys kept = std::move(entry->kept);
  by_key.erase(found);
  by_age.erase(entry);
  return kept;
}

void SurveyCache::Shelf::Put(KeptSurveys kept) {
  const std::uint64_t key = kept.surveys.id().Key();
  Take(key);  // another worker's, whose lease ran out
  const std::size_t size = kept.surveys.bytes();
  by_age.push_front({std::move(kept), size});
  by_key[key] = by_age.begin();
  bytes += size;
}

std::optional<KeptSurveys> SurveyCache::Shelf::TakeOldestAbove(std::size_t limit) {
  if (bytes <= limit || by_age.empty()) {
    return std::nullopt;
  }
  return Take(by_age.back().kept.surveys.id().Key());
}

std::optional<KeptSurveys> SurveyCache::Take(const TileId& id) {
  std::optional<KeptSurveys> kept;
  {
    const std::lock_guard lock(mutex_);
    kept = plain_.Take(id.Key());
    if (!kept) {
      kept = packed_.Take(id.Key());
    }
  }
  if (kept) {
    kept->surveys.Unpack();
  }
  return kept;
}

void SurveyCache::Put(KeptSurveys kept) {
  std::unique_lock lock(mutex_);
  plain_.Put(std::move(kept));
  while (auto oldest = plain_.TakeOldestAbove(limits_.plain_bytes)) {
    lock.unlock();
    oldest->surveys.Pack();  // takes milliseconds
    lock.lock();
    packed_.Put(*std::move(oldest));
  }
  while (packed_.TakeOldestAbove(limits_.packed_bytes)) {
  }
}

std::size_t SurveyCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return plain_.bytes + packed_.bytes;
}

}  // namespace atlas
