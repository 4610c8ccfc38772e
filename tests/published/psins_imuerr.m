% IMU noise for PSINS, written by allanite VERSION
% from bench <b>7</b> & co.csv, SHA-256 9f2c4f4c5a0d9a5c0e0a64dd4cf1a0b5c9c1d5ee2a74a45a54c8fa9c1a3c9be1, 43200 s at 100.0 Hz
% continuous: PSINS makes the numbers discrete itself
% sqrtR0: stationary standard deviation of the bias, Tau its time
% eb, db, the constant biases, are not a matter of noise: zero here
% CAUTION: sqrtR0 is a standard deviation if Tau is finite, and a random walk per sqrt(h) if Tau is infinite
% bias = first-order Gauss-Markov process: sigma its stationary standard deviation, T its time
% of flicker: sigma = 1.0760 B, the process with the same peak of the Allan deviation, with T = 100 s as given
% the random walk K has no slot beside it: over long times the bias drifts more
% one number for all axes, the root mean square of the axes; not inflated
% B: IEEE Std 952 coefficient (floor of the Allan deviation / 0.664)
% [ ]: 95 % interval
% LEFT OUT: not in the numbers of this file
%
% gyroscope, N in rad/s/sqrt(Hz); B, sigma in rad/s; K in rad/s^2/sqrt(Hz):
%   gyro_x: N 8.7301e-05 [8.7127e-05, 8.7476e-05]; B 2.4725e-05 [2.2301e-05, 2.7150e-05]; sigma = 1.0760 B = 2.6605e-05, with T 100 s; K 7.7376e-07 [5.4105e-07, 1.0065e-06] LEFT OUT
%   gyro_y: N 9.3121e-05 [9.2935e-05, 9.3308e-05]; B 2.0769e-05 [1.8733e-05, 2.2806e-05]; sigma = 1.0760 B = 2.2348e-05, with T 100 s; K < 6.3026e-07 (95 % upper limit) LEFT OUT
%   gyro_y: N 9.3121e-05 [9.2935e-05, 9.3308e-05]; Gauss-Markov sigma 2.1910e-05 [2.0376e-05, 2.3882e-05], T 180 s [93.6, 309.6], with T 100 s; K < 1.8617e-07 (95 % upper limit) LEFT OUT
%   gyro_y: the record cannot decide between these two; the larger numbers are used
%   gyro_z: N 7.8571e-05 [7.8414e-05, 7.8728e-05]; B 1.4835e-05 [1.3381e-05, 1.6290e-05]; sigma = 1.0760 B = 1.5963e-05, with T 100 s; K < 1.5708e-07 (95 % upper limit) LEFT OUT; Q 1.5514e-05 rad LEFT OUT
%
% accelerometer, N in m/s^2/sqrt(Hz); B, sigma in m/s^2; K in m/s^3/sqrt(Hz):
%   acc_x: N 5.0020e-04 [4.9920e-04, 5.0120e-04]; B 2.0006e-04 [1.8044e-04, 2.1967e-04]; sigma = 1.0760 B = 2.1526e-04, with T 100 s; K 6.9562e-06 [4.8641e-06, 9.0483e-06] LEFT OUT
%   acc_y: N 4.6685e-04 [4.6592e-04, 4.6779e-04]; B 2.4007e-04 [2.1653e-04, 2.6360e-04]; sigma = 1.0760 B = 2.5831e-04, with T 100 s; K < 9.3333e-07 (95 % upper limit) LEFT OUT
%   acc_z: N 6.8361e-04 [6.8224e-04, 6.8497e-04]; B < 7.5167e-06 (95 % upper limit, used); sigma = 1.0760 B = 8.0879e-06, with T 100 s; K < 1.3667e-06 (95 % upper limit) LEFT OUT

eb = 0.000000e+00;  % deg/h
web = 2.974964e-01;  % deg/sqrt(h)
sqrtR0G = 4.553485e+00;  % deg/h
TauG = 1.000000e+02;  % s
db = 0.000000e+00;  % ug
wdb = 5.694212e+01;  % ug/sqrt(Hz)
sqrtR0A = 1.980165e+01;  % ug
TauA = 1.000000e+02;  % s
imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);
