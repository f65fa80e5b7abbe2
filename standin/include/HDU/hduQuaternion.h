/* SPDX-License-Identifier: Apache-2.0 */
/* Quaternions s + v, written by kerf with the names that programs use. */
#ifndef KERF_STAND_IN_HDU_QUATERNION_H
#define KERF_STAND_IN_HDU_QUATERNION_H

#include <HDU/hduMatrix.h>

#ifdef __cplusplus

/* A rotation, if its length is 1: it turns a vector w to q w conj(q), as its matrix does by w M. */
class hduQuaternion {
 public:
  hduQuaternion() : s_(1) {}
  hduQuaternion(double s, const hduVector3Dd& v) : s_(s), v_(v) {}
  /* About an axis of any length but 0, by the right hand, rad. */
  hduQuaternion(const hduVector3Dd& axis, double angle) { fromAxisAngle(axis, angle); }
  /* Of the matrix of a rotation; of its two quaternions that with s >= 0. */
  explicit hduQuaternion(const hduMatrix& m) {
    /* The largest of the four numbers first: nothing is divided by a small one. */
    const double four[4] = {1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
                            1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]};
    int most = 0;
    for (int i = 1; i < 4; ++i) {
      if (four[i] > four[most]) most = i;
    }
    const double twice = sqrt(four[most] > 0 ? four[most] : 0), part = twice > 0 ? 0.5 / twice : 0;
    const double x = m[1][2] - m[2][1], y = m[2][0] - m[0][2], z = m[0][1] - m[1][0];
    const double xy = m[0][1] + m[1][0], xz = m[0][2] + m[2][0], yz = m[1][2] + m[2][1];
    if (most == 0) {
      s_ = twice / 2;
      v_.set(x * part, y * part, z * part);
    } else if (most == 1) {
      s_ = x * part;
      v_.set(twice / 2, xy * part, xz * part);
    } else if (most == 2) {
      s_ = y * part;
      v_.set(xy * part, twice / 2, yz * part);
    } else {
      s_ = z * part;
      v_.set(xz * part, yz * part, twice / 2);
    }
    if (s_ < 0) *this = hduQuaternion(-s_, -v_);
  }

  double s() const { return s_; }
  double& s() { return s_; }
  const hduVector3Dd& v() const { return v_; }
  hduVector3Dd& v() { return v_; }

  void fromAxisAngle(const hduVector3Dd& axis, double angle) {
    s_ = cos(angle / 2);
    v_ = ::normalize(axis) * sin(angle / 2);
  }
  void toAxisAngle(hduVector3Dd& axis, double& angle) const {
    angle = 2 * atan2(v_.magnitude(), s_);
    axis = ::normalize(v_);
  }
  void toRotMatrix(hduMatrix& m) const {
    const double x = v_[0], y = v_[1], z = v_[2];
    m = hduMatrix(1 - 2 * (y * y + z * z), 2 * (x * y + s_ * z), 2 * (x * z - s_ * y), 0,  //
                  2 * (x * y - s_ * z), 1 - 2 * (x * x + z * z), 2 * (y * z + s_ * x), 0,  //
                  2 * (x * z + s_ * y), 2 * (y * z - s_ * x), 1 - 2 * (x * x + y * y), 0,  //
                  0, 0, 0, 1);
  }

  double magnitude() const { return sqrt(s_ * s_ + v_.dotProduct(v_)); }
  /* To a length of 1; one of length 0 stays. */
  void normalize() {
    const double length = magnitude();
    if (length > 0) *this = hduQuaternion(s_ / length, v_ / length);
  }
  hduQuaternion conjugate() const { return hduQuaternion(s_, -v_); }
  hduQuaternion inverse() const {
    const double square = s_ * s_ + v_.dotProduct(v_);
    return hduQuaternion(s_ / square, -v_ / square);
  }

  friend hduQuaternion operator*(const hduQuaternion& a, const hduQuaternion& b) {
    return hduQuaternion(a.s_ * b.s_ - a.v_.dotProduct(b.v_),
                         b.v_ * a.s_ + a.v_ * b.s_ + a.v_.crossProduct(b.v_));
  }
  friend hduQuaternion operator*(const hduQuaternion& q, double s) {
    return hduQuaternion(q.s_ * s, q.v_ * s);
  }
  friend hduQuaternion operator+(const hduQuaternion& a, const hduQuaternion& b) {
    return hduQuaternion(a.s_ + b.s_, a.v_ + b.v_);
  }
  friend hduQuaternion operator-(const hduQuaternion& a, const hduQuaternion& b) {
    return hduQuaternion(a.s_ - b.s_, a.v_ - b.v_);
  }
  friend std::ostream& operator<<(std::ostream& stream, const hduQuaternion& q) {
    return stream << q.s_ << ' ' << q.v_;
  }

 private:
  double s_;
  hduVector3Dd v_;
};

#endif
#endif
