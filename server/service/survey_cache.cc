#include "server/service/survey_cache.h"

#include <utility>

namespace atlas {

std::optional<TileSurveys> SurveyCache::Shelf::Take(std::uint64_t key) {
  const auto found = by_key.find(key);
  if (found == by_key.end()) {
    return std::nullopt;
  }
  const auto entry = found->second;
  bytes -= entry->bytes;
  TileSurveys surveys = std::move(entry->surveys);
  by_key.erase(found);
  by_age.erase(entry);
  return surveys;
}

void SurveyCache::Shelf::Put(TileSurveys surveys) {
  const std::uint64_t key = surveys.id().Key();
  Take(key);  // another worker's, whose lease ran out
  const std::size_t size = surveys.bytes();
  by_age.push_front({std::move(surveys), size});
  by_key[key] = by_age.begin();
  bytes += size;
}

std::optional<TileSurveys> SurveyCache::Shelf::TakeOldestAbove(std::size_t limit) {
  if (bytes <= limit || by_age.empty()) {
    return std::nullopt;
  }
  return Take(by_age.back().surveys.id().Key());
}

std::optional<TileSurveys> SurveyCache::Take(const TileId& id) {
  std::optional<TileSurveys> surveys;
  {
    const std::lock_guard lock(mutex_);
    surveys = plain_.Take(id.Key());
    if (!surveys) {
      surveys = packed_.Take(id.Key());
    }
  }
  if (surveys) {
    surveys->Unpack();
  }
  return surveys;
}

void SurveyCache::Put(TileSurveys surveys) {
  std::unique_lock lock(mutex_);
  plain_.Put(std::move(surveys));
  while (auto oldest = plain_.TakeOldestAbove(limits_.plain_bytes)) {
    lock.unlock();
    oldest->Pack();  // takes milliseconds
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
