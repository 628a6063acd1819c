% Loads model.mat, model.json and signals.mat of the working directory and simulates; an error ends Octave with exit code 1.
m = load ('model.mat');
s = load ('signals.mat');

% the kinds of values are those that MATLAB code expects
assert (isreal (m.A) && issquare (m.A) && isequal (size (m.B), [rows(m.A), 1]) && isequal (size (m.C), [1, rows(m.A)]));
assert (iscellstr (m.parameter_names) && numel (m.parameter_names) == rows (m.covariance));
assert (ischar (m.uses) && strcmp (m.uses, 'model.pem') && isstruct (m.units) && strcmp (m.units.output, 'V'));
assert (islogical (m.attributes.converged) && m.Ts == m.sample_time_s);
assert (iscomplex (m.poles) && issymmetric (m.covariance, 1e-12) && all (eig (m.covariance) > -1e-12 * norm (m.covariance)));
assert (strcmp (m.parameter_names{1}, 'a1') && m.parameters(1) == -m.A(1, 1));

% the same numbers as JSON; Octave's own parser is not exact in the last bit (python/afmid/tests compare those)
j = jsondecode (fileread ('model.json'));
for name = {'A', 'B', 'C', 'D', 'K', 'covariance', 'x0', 'parameters'}
  n = name{1};
  worst = max (abs (reshape (j.(n), size (m.(n)))(:) - m.(n)(:)) ./ max (abs (m.(n)(:)), realmin));
  assert (worst <= 2 * eps, sprintf ('JSON and MATLAB file differ in %s by %g', n, worst));
end

% eigenvalues of two programs: rounding times a condition of at most 1e4
for pole = eig (m.A).'
  assert (min (abs (m.poles - pole)) < 1e-11);
end

% offset and drift are no part of the model; the drift runs through zero in the middle of the record
N = numel (s.force);
level = m.attributes.offset_v + m.attributes.drift_v_per_s * m.Ts * ((0:N-1)' - (N - 1) / 2);
x = m.x0;
yhat = zeros (N, 1);
for t = 1:N
  yhat(t) = m.C * x + m.D * s.force(t) + level(t);
  x = m.A * x + m.B * s.force(t) + m.K * (s.response(t) - yhat(t));
end
worst = max (abs (yhat - s.prediction));
printf ('Octave %s: %d samples, order %d: the prediction differs from afmid''s by at most %.1e V\n', version (), N, rows (m.A), worst);
% sums over 8192 samples, poles as near to the circle as 1e-3: 1e-16 per operation times 1e3 and some
assert (worst < 1e-10);

% and the test can fail: another Kalman gain predicts otherwise
x = m.x0;
for t = 1:N
  yhat(t) = m.C * x + m.D * s.force(t) + level(t);
  x = m.A * x + m.B * s.force(t);
end
assert (max (abs (yhat - s.prediction)) > 1e-6);
