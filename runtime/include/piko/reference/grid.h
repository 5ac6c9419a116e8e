//===- piko/reference/grid.h - The bins of a stage ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A grid of bins over the domain, of any rank up to four. Unused dimensions
// have one cell and one bin. The last bin of a dimension may be partial.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_GRID_H
#define PIKO_REFERENCE_GRID_H

#include <piko/macros_begin.h>

#include <piko/bins.h>

#include <algorithm>
#include <array>
#include <string>

namespace piko::reference {

using Cell = std::array<int64_t, 4>;

/// A glm vector with its unused dimensions filled.
template <int Rank>
Cell toCell(const glm::vec<Rank, int, glm::defaultp> &v, int64_t rest = 0) {
  Cell cell{rest, rest, rest, rest};
  for (int d = 0; d < Rank; ++d)
    cell[d] = v[d];
  return cell;
}
template <int Rank>
Cell toCell(const glm::vec<Rank, float, glm::defaultp> &v, int64_t rest = 0) {
  Cell cell{rest, rest, rest, rest};
  for (int d = 0; d < Rank; ++d)
    cell[d] = detail::cellOf(v[d]);
  return cell;
}
template <int Rank> Cells<Rank> fromCell(const Cell &cell) {
  Cells<Rank> v;
  for (int d = 0; d < Rank; ++d)
    v[d] = static_cast<int>(cell[d]);
  return v;
}

/// "(x, y, z)", for messages.
inline std::string toText(const Cell &cell, int rank) {
  std::string text = "(" + std::to_string(cell[0]);
  for (int d = 1; d < rank; ++d)
    text += ", " + std::to_string(cell[d]);
  return text + ")";
}

/// The most cells of a domain in a dimension, as pikort_set_domain has it.
inline constexpr int64_t maxExtent = 1073741824;

struct BinGrid {
  Cell domain{1, 1, 1, 1};
  Cell size{1, 1, 1, 1};  ///< cells of a bin
  Cell count{1, 1, 1, 1}; ///< bins of the grid

  BinGrid() = default;
  BinGrid(const Cell &domain, const Cell &binSize) : domain(domain) {
    for (int d = 0; d < 4; ++d) {
      size[d] = binSize[d] ? binSize[d] : domain[d];
      count[d] = (domain[d] + size[d] - 1) / size[d];
    }
  }

  int64_t bins() const { return count[0] * count[1] * count[2] * count[3]; }

  /// The number of the bin with the given place in the grid.
  int64_t bin(const Cell &place) const {
    return ((place[3] * count[2] + place[2]) * count[1] + place[1]) * count[0] +
           place[0];
  }

  /// The bin that holds a cell, or -1 outside the domain.
  int64_t binAt(const Cell &cell) const {
    int64_t bin = 0;
    for (int d = 3; d >= 0; --d) {
      if (cell[d] < 0 || cell[d] >= domain[d])
        return -1;
      bin = bin * count[d] + cell[d] / size[d];
    }
    return bin;
  }

  /// The first cell of a bin.
  Cell lo(int64_t bin) const {
    Cell cell;
    for (int d = 0; d < 4; ++d) {
      cell[d] = bin % count[d] * size[d];
      bin /= count[d];
    }
    return cell;
  }
  /// One past the last cell of a bin in each dimension.
  Cell hi(int64_t bin) const {
    Cell cell = lo(bin);
    for (int d = 0; d < 4; ++d)
      cell[d] = std::min(cell[d] + size[d], domain[d]);
    return cell;
  }
};

} // namespace piko::reference

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_GRID_H
