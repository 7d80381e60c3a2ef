// Whether a vehicle is known to be where it is tracked. A place that was found after it was lost,
// or far from where it was expected, may be another that looks like it: one deck of a garage off it
// fits for as long as the drive goes on. It is confirmed by scans that follow, each of them
// registered on the decks above and below, too.
#pragma once

#include <optional>
#include <vector>

#include "core/localization/belief/other_decks.h"
#include "core/localization/belief/place_score.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/registration.h"

namespace atlas {

// When scans tell two places apart (PlaceScore): on average of the scans one scores more by `mean`,
// and by `sum` in all. Along simulated drives through a garage of four decks other decks were ahead
// by 0.04 at most, of single scans on ramps, and by 0.1 in all; the right one by 0.03 to 0.2 of
// each scan.
struct LeadOptions {
  int scans = 3;
  double mean = 0.03;
  double sum = 0.24;

  bool IsClear(double lead, int scans_compared) const {
    return scans_compared >= scans && lead >= sum && lead >= mean * scans_compared;
  }
};

struct ConfirmationOptions {
  DeckOptions decks;
  LeadOptions lead;  // over any other deck

  // A scan speaks for a place when it fits as well as is asked, when this share of its columns
  // stands on structure there and so much of it is explained ...
  double min_columns = 0.1;
  double min_explained = 0.04;
  // ... and it is confirmed by so many in a row that fit as usual on this drive, or this well, or
  // by more that fit well enough.
  double usual_share = 0.85;
  double usual_fit = 0.6;
  double good_fit = 0.45;
  int usual_scans = 3;
  int good_scans = 20;
  // A deck that is ahead by so much makes a place suspected, puts it in doubt when it is so over
  // these many scans, and takes the vehicle over. One that is ahead by this little does not count
  // where the vehicle was tracked until now.
  double taken_margin = 0.12;
  int suspected_scans = 5;
  double tracked_margin = 0.04;

  int compared_after = 10;  // scans, where nothing is in doubt

  double many_columns = kManyColumns;  // DeckWeight

  // How far off a place may be that is not confirmed, standard deviations.
  double sigma_m = 10.0;
  double sigma_up_m = 5.0;
  double sigma_rad = 0.5;
};

class Confirmation {
 public:
  Confirmation(const ConfirmationOptions& options, const RegistrationOptions& registration)
      : options_(options), registration_(registration), decks_(options.decks) {
    rivals_.reserve(options.decks.most);
    before_.reserve(options.decks.most);
  }

  bool is_confirmed() const { return is_confirmed_; }
  // Known, but the last scans fit better on another deck.
  bool is_suspected() const { return is_confirmed_ && !rivals_.empty(); }
  // The place is known: it was told.
  void Trust();
  // The place is a new one: nothing has spoken for it.
  void Doubt();
  // Something is odd where it was tracked to.
  void Question();
  // The scan fits nothing here.
  void Miss();

  // Whether the scan fits as usual and as much of it as is asked is explained. `usual_fit`: of this
  // drive, 0 where none is known.
  bool IsAsUsual(const RegistrationResult& here,
                 const ScanFeatures& features,
                 double usual_fit) const;
  // Whether the scan speaks for a place that is not confirmed at all.
  bool IsEnough(const RegistrationResult& here, const ScanFeatures& features) const;

  // The scan was registered `here`. While that is confirmed it is compared with other decks now and
  // then, and at once where it `is_doubtful`; one that is better over some scans puts it in doubt.
  // In doubt, it counts for confirmation; or the registration on another deck comes back, where the
  // vehicle is rather: in doubt there, too.
  std::optional<RegistrationResult> Weigh(const MapWindow& map,
                                          const ScanFeatures& features,
                                          const RegistrationResult& here,
                                          double usual_fit,
                                          bool is_doubtful);

  // What is to be added to the covariance of a place that is not confirmed.
  PoseCovariance Spread() const;

 private:
  // Another deck, and what scans said of it.
  struct Rival {
    double up_m = 0.0;
    // Sums of how much better each scan fits here, by all that the map knows of either place and by
    // what it knows of both: a deck that was mapped better explains more, whichever the vehicle is
    // on.
    double by_all = 0.0;
    double by_common = 0.0;
    int scans = 0;
    bool is_at_edge = false;          // of the map, at the last scan
    RegistrationResult registration;  // of the last scan
  };

  // How far a rival is behind, on average of its scans: by both, where the vehicle was tracked here
  // or the map ends here.
  double Margin(const Rival& rival) const;
  // Renews rivals_.
  void Compare(const MapWindow& map, const ScanFeatures& features, const RegistrationResult& here);
  bool IsAhead() const;  // of all rivals
  void Count(bool is_good, bool is_usual);

  ConfirmationOptions options_;
  RegistrationOptions registration_;
  bool is_confirmed_ = true;
  bool is_new_ = false;  // where it is not confirmed: else it was tracked there
  int usual_scans_ = 0;  // in a row that spoke for the place
  int good_scans_ = 0;
  int uncompared_ = 0;  // scans, while it is confirmed
  DeckFinder decks_;
  bool is_at_edge_ = false;  // of the map, at the last scan
  std::vector<Rival> rivals_;
  std::vector<Rival> before_;  // rivals_ at the scan before; kept for its memory
  std::vector<std::optional<float>> here_weights_;  // of the scan at hand; kept for their memory
  std::vector<std::optional<float>> rival_weights_;
};

}  // namespace atlas
