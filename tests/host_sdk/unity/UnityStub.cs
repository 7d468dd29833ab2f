// The part of UnityEngine that Samples~/ProbeLight uses, so that the component is compiled and run without Unity.
using System;

namespace UnityEngine
{
    public class Object { }

    public class MonoBehaviour : Object
    {
        private readonly Transform own = new Transform();
        private readonly Light light = new Light();

        public Transform transform => own;

        public T GetComponent<T>() where T : class => light as T;
    }

    public sealed class Transform
    {
        public Vector3 forward;
    }

    public sealed class Light : Object
    {
        public Color color;
        public float intensity;
    }

    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }

    public struct Color
    {
        public float r, g, b;

        public Color(float r, float g, float b) { this.r = r; this.g = g; this.b = b; }

        public Color gamma => this;
    }

    public static class Debug
    {
        public static void LogError(object message, Object context) => Console.WriteLine("LogError " + message);
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute
    {
        public RequireComponent(Type type) { }
    }

    public static class RenderSettings
    {
        public static Rendering.SphericalHarmonicsL2 ambientProbe;
        public static Rendering.AmbientMode ambientMode;
    }
}

namespace UnityEngine.Rendering
{
    public enum AmbientMode { Skybox, Custom }

    public struct SphericalHarmonicsL2
    {
        private float[] values;

        public float this[int rgb, int coefficient]
        {
            get { return values == null ? 0 : values[9 * rgb + coefficient]; }
            set { (values ?? (values = new float[27]))[9 * rgb + coefficient] = value; }
        }
    }
}
