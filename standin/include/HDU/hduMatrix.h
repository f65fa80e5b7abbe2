/* SPDX-License-Identifier: Apache-2.0 */
/* 4 x 4 matrices of doubles for row vectors (v' = v M), written by kerf with the names that
   programs use: m[3][0..2] is the translation, and the 16 numbers lie in memory as
   hdGetDoublev(HD_CURRENT_TRANSFORM) writes them. */
#ifndef KERF_STAND_IN_HDU_MATRIX_H
#define KERF_STAND_IN_HDU_MATRIX_H

#include <HDU/hduVector.h>

#ifdef __cplusplus

class hduMatrix {
 public:
  hduMatrix() { makeIdentity(); }
  /* Row by row. */
  explicit hduMatrix(const double values[16]) {
    for (int i = 0; i < 16; ++i) (*this)[i / 4][i % 4] = values[i];
  }
  explicit hduMatrix(const double rows[4][4]) { set(rows); }
  hduMatrix(double a, double b, double c, double d, double e, double f, double g, double h,
            double i, double j, double k, double l, double m, double n, double o, double p) {
    const double values[16] = {a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p};
    *this = hduMatrix(values);
  }

  double* operator[](int row) { return m_[row]; }
  const double* operator[](int row) const { return m_[row]; }
  operator double*() { return m_[0]; }
  operator const double*() const { return m_[0]; }
  double get(int row, int column) const { return m_[row][column]; }
  void get(double rows[4][4]) const {
    for (int i = 0; i < 16; ++i) rows[i / 4][i % 4] = m_[i / 4][i % 4];
  }
  void set(int row, int column, double value) { m_[row][column] = value; }
  void set(const double rows[4][4]) {
    for (int i = 0; i < 16; ++i) m_[i / 4][i % 4] = rows[i / 4][i % 4];
  }
  void makeIdentity() {
    for (int i = 0; i < 16; ++i) m_[i / 4][i % 4] = i % 5 == 0 ? 1 : 0;
  }

  /* v a b turns and moves by `a` first. */
  friend hduMatrix operator*(const hduMatrix& a, const hduMatrix& b) {
    hduMatrix product;
    for (int i = 0; i < 16; ++i) {
      double sum = 0;
      for (int k = 0; k < 4; ++k) sum += a[i / 4][k] * b[k][i % 4];
      product[i / 4][i % 4] = sum;
    }
    return product;
  }
  hduMatrix& operator*=(const hduMatrix& right) { return multRight(right); }
  hduMatrix& multRight(const hduMatrix& right) { return *this = *this * right; }
  hduMatrix& multLeft(const hduMatrix& left) { return *this = left * *this; }

  /* A point, with the division by its fourth coordinate; a direction, without the translation. */
  void multVecMatrix(const hduVector3Dd& point, hduVector3Dd& out) const {
    double sum[4];
    for (int j = 0; j < 4; ++j)
      sum[j] = point[0] * m_[0][j] + point[1] * m_[1][j] + point[2] * m_[2][j] + m_[3][j];
    out.set(sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]);
  }
  void multDirMatrix(const hduVector3Dd& direction, hduVector3Dd& out) const {
    double sum[3];
    for (int j = 0; j < 3; ++j)
      sum[j] = direction[0] * m_[0][j] + direction[1] * m_[1][j] + direction[2] * m_[2][j];
    out.set(sum[0], sum[1], sum[2]);
  }
  friend hduVector3Dd operator*(const hduVector3Dd& point, const hduMatrix& m) {
    hduVector3Dd out;
    m.multVecMatrix(point, out);
    return out;
  }
  /* As a column vector: M v. */
  void multMatrixVec(const hduVector3Dd& point, hduVector3Dd& out) const {
    getTranspose().multVecMatrix(point, out);
  }

  hduMatrix getTranspose() const {
    hduMatrix turned;
    for (int i = 0; i < 16; ++i) turned[i % 4][i / 4] = m_[i / 4][i % 4];
    return turned;
  }
  hduMatrix& transpose() { return *this = getTranspose(); }
  /* Writes the inverse, by elimination with pivots, and returns true; false, and nothing, if there
   * is none. */
  bool getInverse(hduMatrix& out) const {
    hduMatrix left(*this), right;
    for (int column = 0; column < 4; ++column) {
      int pivot = column;
      for (int row = column + 1; row < 4; ++row) {
        if (fabs(left[row][column]) > fabs(left[pivot][column])) pivot = row;
      }
      if (left[pivot][column] == 0) return false;
      for (int j = 0; j < 4; ++j) {
        swap(left[pivot][j], left[column][j]);
        swap(right[pivot][j], right[column][j]);
      }
      const double scale = 1 / left[column][column];
      for (int j = 0; j < 4; ++j) {
        left[column][j] *= scale;
        right[column][j] *= scale;
      }
      for (int row = 0; row < 4; ++row) {
        const double part = row == column ? 0 : left[row][column];
        for (int j = 0; j < 4; ++j) {
          left[row][j] -= part * left[column][j];
          right[row][j] -= part * right[column][j];
        }
      }
    }
    out = right;
    return true;
  }
  hduMatrix getInverse() const {
    hduMatrix inverse;
    getInverse(inverse);
    return inverse;
  }
  /* Stays as it is if it has no inverse. */
  bool invert() { return getInverse(*this); }

  /* The rotation alone, of a matrix that turns, moves and scales; `out` may be this matrix. */
  void getRotationMatrix(hduMatrix& out) const {
    hduMatrix rotation;
    for (int i = 0; i < 3; ++i) {
      const double length = sqrt(m_[i][0] * m_[i][0] + m_[i][1] * m_[i][1] + m_[i][2] * m_[i][2]);
      for (int j = 0; j < 3; ++j) rotation[i][j] = length > 0 ? m_[i][j] / length : 0;
    }
    out = rotation;
  }

  static hduMatrix createTranslation(double x, double y, double z) {
    return hduMatrix(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1);
  }
  static hduMatrix createTranslation(const hduVector3Dd& v) {
    return createTranslation(v[0], v[1], v[2]);
  }
  static hduMatrix createScale(double x, double y, double z) {
    return hduMatrix(x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1);
  }
  static hduMatrix createScale(const hduVector3Dd& v) { return createScale(v[0], v[1], v[2]); }
  /* About an axis of any length but 0, by the right hand, rad. */
  static hduMatrix createRotation(const hduVector3Dd& axis, double angle) {
    const hduVector3Dd u = normalize(axis);
    const double c = cos(angle), s = sin(angle), t = 1 - c;
    return hduMatrix(
        t * u[0] * u[0] + c, t * u[0] * u[1] + s * u[2], t * u[0] * u[2] - s * u[1], 0,  //
        t * u[0] * u[1] - s * u[2], t * u[1] * u[1] + c, t * u[1] * u[2] + s * u[0], 0,  //
        t * u[0] * u[2] + s * u[1], t * u[1] * u[2] - s * u[0], t * u[2] * u[2] + c, 0,  //
        0, 0, 0, 1);
  }
  static hduMatrix createRotation(double x, double y, double z, double angle) {
    return createRotation(hduVector3Dd(x, y, z), angle);
  }
  static hduMatrix createRotationAroundX(double angle) { return createRotation(1, 0, 0, angle); }
  static hduMatrix createRotationAroundY(double angle) { return createRotation(0, 1, 0, angle); }
  static hduMatrix createRotationAroundZ(double angle) { return createRotation(0, 0, 1, angle); }

  friend std::ostream& operator<<(std::ostream& stream, const hduMatrix& m) {
    for (int i = 0; i < 16; ++i) stream << m[i / 4][i % 4] << (i % 4 == 3 ? '\n' : ' ');
    return stream;
  }

 private:
  static void swap(double& a, double& b) {
    const double old = a;
    a = b;
    b = old;
  }

  double m_[4][4];
};

#endif
#endif
