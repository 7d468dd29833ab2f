// The part of UnityEngine that Samples~/ProbeLight and LightGrid use, so that they are compiled and run without Unity.
using System;
using System.Collections.Generic;

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
        public Vector3 forward, position, localPosition;
        public GameObject gameObject;
        public readonly List<Transform> children = new List<Transform>();

        public int childCount => children.Count;

        public void SetParent(Transform parent, bool worldPositionStays) => parent.children.Add(this);
    }

    public sealed class GameObject : Object
    {
        public readonly Transform transform = new Transform();
        public object component;

        public GameObject(string name) { transform.gameObject = this; }

        public T AddComponent<T>() where T : class, new()
        {
            var made = new T();
            component = made;
            return made;
        }
    }

    public enum LightType { Spot, Directional, Point }

    public enum LightShadows { None, Hard, Soft }

    public sealed class Light : Object
    {
        public Color color;
        public float intensity, range;
        public LightType type;
        public LightShadows shadows;
    }

    public sealed class TextAsset : Object
    {
        public string text;
    }

    public static class Mathf
    {
        public const float PI = (float)Math.PI;
    }

    public sealed class LightProbes : Object
    {
        public Vector3[] positions;
        public Rendering.SphericalHarmonicsL2[] bakedProbes;
    }

    public static class LightmapSettings
    {
        public static LightProbes lightProbes;
    }

    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }

        public static Vector3 operator -(Vector3 a, Vector3 b) => new Vector3(a.x - b.x, a.y - b.y, a.z - b.z);
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

        public static SphericalHarmonicsL2 operator *(SphericalHarmonicsL2 sh, float factor)
        {
            var scaled = new SphericalHarmonicsL2();
            for (var i = 0; i < 27; ++i) scaled[i / 9, i % 9] = factor * sh[i / 9, i % 9];
            return scaled;
        }
    }
}
